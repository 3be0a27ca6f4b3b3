// SPDX-License-Identifier: MIT
// Touch probes, the positioning options 60F2h, and bit 11 at the position limits 607Dh. 10,000 increments a
// revolution, 1,000,000/s^2.
#include "drive_bench.hpp"

namespace cbcan::test {

namespace {

DriveBench& level(DriveBench& bench, std::uint16_t input, double value) {
  CHECK(bench.input(input, value));
  return bench.update();
}

/// Profile velocity 100,000/s, reached after 0.1 s and 5,000 increments.
void speed_up(DriveBench& bench) {
  bench.enable(3, {{0x60FF, 0, 100'000}}).pass(100'000).shows({.velocity = 100'000});
}

void travel_to(DriveBench& bench, std::int64_t target, unsigned bits = 0) {
  bench.set_point(target, bits).pass(2 * kSecond);
}

}  // namespace

TEST_CASE("Touch probe: the first edge of its input, until it is switched off") {
  DriveBench bench;
  level(bench, 0x60BA, 1).shows({.objects = {{0x60B9, 0}}});
  speed_up(bench);
  bench.set(0x60B8, 0, 0x0031).shows({.objects = {{0x60B9, 0x0001}}});
  bench.events.clear();
  bench.pass(10'000);
  level(bench, 0x60BA, 0.4).shows({.objects = {{0x60B9, 0x0005}, {0x60BB, 6'000}}});
  CHECK(bench.events == std::vector<std::uint16_t>{0x60B9});
  bench.pass(10'000);
  level(bench, 0x60BA, 0.5).shows({.objects = {{0x60B9, 0x0007}, {0x60BA, 7'000}}});
  bench.pass(10'000);
  level(level(bench, 0x60BA, 0), 0x60BA, 1).shows({.objects = {{0x60BA, 7'000}, {0x60BB, 6'000}}});
  bench.set(0x60B8, 0, 0x0021).shows({.objects = {{0x60B9, 0x0005}}});  // the positive edge alone is off
  bench.set(0x60B8, 0, 0x0031);
  level(level(bench, 0x60BA, 0), 0x60BA, 1)
      .shows({.objects = {{0x60B9, 0x0007}, {0x60BA, 8'000}, {0x60BB, 6'000}}});
  bench.set(0x60B8, 0, 0x0030).shows({.objects = {{0x60B9, 0}, {0x60BA, 8'000}}});
}

TEST_CASE("Touch probe: the second one, each edge") {
  DriveBench bench;
  speed_up(bench);
  bench.set(0x60B8, 0, 0x1300);
  for (int edge = 1; edge <= 3; ++edge) {
    bench.pass(10'000);
    level(level(bench, 0x60BC, 1), 0x60BC, 0);
    bench.shows({.objects = {{0x60B9, 0x0300}, {0x60BC, 5'000 + 1'000 * edge}, {0x60BD, 0}}});
  }
  level(bench, 0x60BA, 1).shows({.objects = {{0x60B9, 0x0300}, {0x60BA, 0}}});
  CHECK_FALSE(bench.input(0x60BB, 1));
}

TEST_CASE("Touch probe: the index pulse, at its own position however late it is noticed") {
  for (const double inertia : {0.0, 1.0}) {
    CAPTURE(inertia);
    DriveBench bench({.load = {.inertia = inertia}});
    speed_up(bench);
    bench.set(0x60B8, 0, 0x3715);  // bit 1 of the second is without effect
    bench.pass(40'000).shows({.objects = {{0x60B9, 0x0101}}});
    bench.pass(20'000).shows(
        {.objects = {{0x60B9, 0x0703}, {0x60BA, 10'000}, {0x60BC, 10'000}, {0x60BD, 10'000}}});
    bench.pass(291'000).shows({.objects = {{0x60BA, 10'000}, {0x60BC, 10'000}}});
    // Back by 5,000 from 45,100; 40,000 is the first on the way down.
    bench.set(0x60B8, 0, 0).set(0x60FF, 0, -100'000).pass(50'000).set(0x60B8, 0, 0x0015).pass(2 * kSecond);
    bench.shows({.objects = {{0x60B9, 0x0003}, {0x60BA, 40'000}}});
  }
}

TEST_CASE("Touch probe: several index pulses in one step of a load") {
  DriveBench bench({.load = {.inertia = 0.001}});
  bench.put({{0x608F, 1, 33}, {0x6092, 1, 33}, {0x6080, 0, 0}});
  speed_up(bench);
  bench.set(0x60B8, 0, 0x1315);  // at 4,972, as the ramp takes a lag of 28; pulse 151 is at 4,983
  bench.pass(10'000).shows({.objects = {{0x60BA, 4'983}, {0x60BC, 0}}});
}

TEST_CASE("Touch probe: the index pulse is waited for only while a probe wants it") {
  DriveBench bench;
  speed_up(bench);
  CHECK(bench.deadline > bench.now + kSecond);
  bench.now += 150'000;  // not updated meanwhile
  bench.set(0x60B8, 0, 0x0015).shows({.objects = {{0x60B9, 0x0001}}});
  CHECK(bench.deadline == bench.now + 100'001);  // from 20,000
  bench.pass(100'000);
  bench.control(0x0000).pass(kSecond);
  CHECK(bench.deadline == kNever);
}

TEST_CASE("60F2h: relative set-points count from the target, the demand or the actual position") {
  for (const auto& [option, reached] : {std::pair{0, 12'000}, {1, 7'000}, {2, 4'500}, {3, 12'000}}) {
    CAPTURE(option);
    DriveBench bench;
    bench.enable(1, {{0x60F2, 0, option}, {0x607A, 0, 10'000}, {0x6065, 0, -1}});
    bench.control(0x001F).control(0x000F).pass(70'711).shows({.position = 2'500});
    bench.incident("motor-blocked", true);
    bench.pass(29'289).shows({.position = 2'500, .objects = {{0x60FC, 5'000}}});
    bench.set(0x607A, 0, 2'000).control(0x007F).incident("motor-blocked", false);
    bench.pass(kSecond).shows({.position = reached});
  }
}

TEST_CASE("60F2h: a rotary axis turns as the numbers say, one way only, or the shortest way") {
  const auto [option, target, way] = GENERATE(table<int, int, std::int64_t>({{0x00, 9'000, 8'000},
                                                                             {0x00, 500, -500},
                                                                             {0x40, 9'000, -2'000},
                                                                             {0x40, 500, -500},
                                                                             {0x40, 1'000, 0},
                                                                             {0x80, 9'000, 8'000},
                                                                             {0x80, 500, 9'500},
                                                                             {0x80, 1'000, 0},
                                                                             {0xC0, 9'000, -2'000},
                                                                             {0xC0, 5'900, 4'900},
                                                                             {0xC0, 500, -500}}));
  INFO("60F2h = " << option << ", " << target);
  DriveBench bench;
  bench.enable(1, {{0x607B, 1, 0}, {0x607B, 2, 9'999}});
  travel_to(bench, 1'000);
  const double before = bench.drive.axis().place(bench.now);
  bench.put(0x60F2, 0, option);
  travel_to(bench, target);
  bench.shows({.status = kEnabled | kReached, .position = target});
  CHECK(bench.drive.axis().place(bench.now) - before == Approx(way));
}

TEST_CASE("60F2h: a relative set-point is as long as it says, and a fraction of an increment needs no turn") {
  DriveBench bench;
  bench.enable(1, {{0x607B, 1, 0}, {0x607B, 2, 9'999}, {0x60F2, 0, 0x80}});
  bench.set(0x607A, 0, 9'000).control(0x001F).pass(70'711).control(0x010F).pass(kSecond);
  bench.shows({.position = 5'000});  // 5,000.04
  const double before = bench.drive.axis().place(bench.now);
  travel_to(bench, 5'000, 0x20);
  CHECK(bench.drive.axis().place(bench.now) == Approx(before).margin(0.1));
  travel_to(bench, -7'000, 0x40);
  CHECK(bench.drive.axis().place(bench.now) == Approx(before - 7'000).margin(0.1));
}

TEST_CASE("Position limits: bit 11 while the axis is outside, in every mode, from the moment it passes") {
  DriveBench bench;
  bench.enable(6, {{0x6098, 0, 35}, {0x607C, 0, -7'000}})
      .control(0x001F)
      .pass(kSecond)
      .shows({.position = 7'000});
  bench.put({{0x607D, 1, -2'000}, {0x607D, 2, 2'000}});
  bench.update();
  for (const int mode : {1, 3, 4, 6, 8, 0}) {
    CAPTURE(mode);
    bench.set(0x6060, 0, mode);
    CHECK((bench.status() & kLimit) == kLimit);
  }
  bench.control(0x0007).shows({.status = 0x0233});  // power is off
  bench.enable(1);
  bench.events.clear();
  bench.put({{0x607A, 0, 0}, {0x6081, 0, 10'000}});
  bench.control(0x001F).shows({.status = kEnabled | kLimit | kBit12});
  bench.control(0x000F).events.clear();
  // 0.01 s and 50 increments, then 4,949.5 at 10,000/s until 6064h shows 2,000.
  bench.pass(400'000);
  CHECK(bench.deadline == bench.now + 104'950);
  bench.pass(104'949).shows({.status = kEnabled | kLimit});
  bench.pass(2).shows({.status = kEnabled, .position = 2'000});
  CHECK(bench.events == std::vector<std::uint16_t>{0x6041});
}

TEST_CASE("Position limits: a torque that drives a load out of them sets bit 11") {
  DriveBench bench({.load = {.inertia = 10, .friction = 50}});
  bench.enable(4, {{0x6087, 0, 0}, {0x6071, 0, 300}, {0x607D, 1, -2'000}, {0x607D, 2, 2'000}});
  bench.pass(100'000).shows(
      {.status = kEnabled | kReached, .position = 1'989});  // 250 x 1591.549/s2 x 0.01 s2 / 2
  bench.pass(1'000).shows({.status = kEnabled | kReached | kLimit});
}

}  // namespace cbcan::test

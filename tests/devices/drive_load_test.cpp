// SPDX-License-Identifier: MIT
// A drive with a load, on the EDS's ramps (see drive_modes_test.cpp): 10,000 increments per revolution; the rated
// torque is 1,000 mNm, as the file has no 6076h. With 10 kg cm2, 1 mNm more than friction is 1 rad/s2, or
// 1591.549 increments/s2.
#include "drive_bench.hpp"

namespace cbcan::test {

namespace {

constexpr double kPerMilliNewtonMetre = 10'000 / 6.283185307;

devices::AxisLayout machine(const devices::AxisLoad& load) {
  return {.negative_limit = -1'000'000, .positive_limit = 1'000'000, .load = load};
}

}  // namespace

TEST_CASE("Load: torque and following error go with the acceleration, torque with friction") {
  DriveBench bench(machine({.inertia = 10, .friction = 50}));
  bench.enable(1);
  bench.set_point(50'000);
  struct Row {
    Time until;  ///< in 0.1 s up, 0.4 s at 100,000/s, 0.1 s down
    std::int64_t torque;
    std::int64_t lag;
  };
  // 1,000,000/s2 are 628.3 rad/s2, and the lag is that acceleration divided by (188/s)^2.
  for (const auto& [until, torque, lag] :
       {Row{90'000, 678, 28}, Row{300'000, 50, 0}, Row{590'000, -578, -28}, Row{900'000, 0, 0}}) {
    bench.pass(1000 + until - bench.now);
    CAPTURE(until);
    CHECK(bench.get(0x6077) == torque);
    CHECK(bench.get(0x6078) == torque);
    CHECK(bench.get(0x60F4) == lag);
  }
  CHECK(bench.position() == 50'000);
  CHECK(bench.get(0x6077) == 0);
  CHECK(bench.deadline == kNever);  // nothing moves
}

TEST_CASE("Load: what the torque limit leaves makes a following error, and then a fault") {
  DriveBench bench(machine({.inertia = 10, .friction = 50}));
  bench.enable(1, {{0x6072, 0, 400}, {0x6065, 0, 2000}, {0x6066, 0, 10}});
  bench.set_point(50'000);
  bench.pass(80'000);
  CHECK(bench.get(0x6077) == 400);
  CHECK(double(bench.position()) ==
        Approx(350 * kPerMilliNewtonMetre * 0.08 * 0.08 / 2).epsilon(0.02));  // the lag is within 2 %
  CHECK(bench.log.empty());
  bench.pass(50'000);  // the lag is 2,000 increments after about 95 ms
  CHECK(bench.log == std::vector<std::string>{"8611/21"});
}

TEST_CASE("Load: torque modes move the axis, up to the hard stop") {
  DriveBench bench(machine({.inertia = 10, .friction = 50}));
  bench.enable(4, {{0x6087, 0, 0}, {0x6071, 0, 300}});
  bench.pass(500'000);
  CHECK(double(bench.velocity()) == Approx(250 * kPerMilliNewtonMetre * 0.5).epsilon(0.001));
  CHECK(double(bench.position()) == Approx(250 * kPerMilliNewtonMetre * 0.125).epsilon(0.001));
  CHECK(bench.get(0x6077) == 300);
  bench.set(0x6071, 0, 0);  // friction alone stops it: 5 times as long
  bench.pass(2'600'000);
  CHECK(bench.velocity() == 0);
  CHECK(double(bench.position()) == Approx(250 * kPerMilliNewtonMetre * 0.125 * 6).epsilon(0.001));
  CHECK(bench.deadline == kNever);
  bench.set(0x6071, 0, 500);
  bench.pass(5'000'000);
  CHECK(bench.position() == 1'050'000);
  CHECK(bench.velocity() == 0);
  CHECK((bench.get(0x60FD) & 2) == 2);
  bench.set(0x6060, 0, 1);  // position control starts from the current position
  bench.pass(100'000);
  CHECK(bench.position() == 1'050'000);
  CHECK(bench.get(0x60F4) == 0);
}

TEST_CASE("Load: gravity is held with power or by the brake, and else pulls down") {
  DriveBench bench(machine({.inertia = 10, .friction = 50, .gravity = 200}));
  bench.put(0x60FE, 2, 1);
  bench.set(0x60FE, 1, 1);
  bench.pass(1'000'000);
  CHECK(bench.position() == 0);
  bench.enable(1);
  bench.set(0x60FE, 1, 0);
  bench.pass(1'000'000);
  CHECK(bench.position() == 0);
  CHECK(bench.get(0x6077) == 200);
  bench.control(0x0000);
  bench.pass(400'000);
  CHECK(double(bench.position()) == Approx(-150 * kPerMilliNewtonMetre * 0.08).epsilon(0.01));
  CHECK(bench.get(0x6077) == 0);
  bench.pass(9'000'000);
  CHECK(bench.position() == -1'050'000);
}

TEST_CASE("Load: what is heavier than the torque allows falls") {
  DriveBench bench(machine({.inertia = 10, .friction = 0, .gravity = 600}));
  bench.enable(1);
  bench.pass(100'000);
  CHECK(bench.position() == 0);
  bench.set(0x6072, 0, 500);
  bench.pass(200'000);
  CHECK(double(bench.position()) == Approx(-100 * kPerMilliNewtonMetre * 0.02).epsilon(0.01));
}

TEST_CASE("Load: without limit switches there are no hard stops") {
  DriveBench bench({.load = {.inertia = 10, .friction = 50}});
  bench.enable(4, {{0x6087, 0, 0}, {0x6071, 0, 300}});
  bench.pass(5'000'000).shows({.objects = {{0x60FD, 0}}});
  CHECK(double(bench.position()) == Approx(250 * kPerMilliNewtonMetre * 12.5).epsilon(0.001));
}

TEST_CASE("Load: bit 11 while it takes all of 6072h, bit 10 where 6064h is") {
  DriveBench bench(machine({.inertia = 10, .friction = 50}));
  bench.enable(1, {{0x6072, 0, 400}, {0x6065, 0, 0xFFFFFFFF}, {0x6067, 0, 0xFFFFFFFF}});
  bench.set_point(50'000);
  bench.pass(80'000).shows({.status = kEnabled | kLimit});  // 678 would be needed
  bench.pass(520'000);
  CHECK(bench.get(0x6062) == 50'000);
  CHECK(bench.position() != 50'000);
  CHECK((bench.status() & kReached) == 0);
  bench.pass(kSecond).shows({.status = kEnabled | kReached, .position = 50'000});
}

TEST_CASE("Load: a brake that is set holds until operation is enabled, and again after it") {
  DriveBench bench(machine({.inertia = 10, .friction = 50, .gravity = 200}));
  bench.put({{0x60FE, 2, 0xF0001}, {0x60FE, 1, 1}});
  bench.update();
  bench.pass(kSecond).shows({.position = 0});
  bench.enable(1);
  bench.set_point(5'000);
  bench.pass(kSecond).shows({.status = kEnabled | kReached, .position = 5'000});
  bench.set(0x60FE, 1, 0).set(0x60FE, 1, 1);  // a brake set during operation holds despite power
  bench.set_point(6'000);
  bench.pass(kSecond).shows({.position = 5'000});
  bench.set(0x60FE, 1, 0);
  bench.pass(kSecond).shows({.position = 6'000});
  bench.set(0x60FE, 1, 1).control(0x0000);
  bench.pass(kSecond).shows({.status = 0x0250, .position = 6'000, .objects = {{0x60F4, 0}}});
}

TEST_CASE("Load: it moves the same, however often it is read") {
  std::vector<std::int64_t> known;
  for (const Time look : {Time{0}, Time{137}, Time{2'500}, Time{33'333}}) {
    DriveBench bench(machine({.inertia = 20, .friction = 30, .gravity = 100}));
    bench.enable(1, {{0x6072, 0, 700}});
    bench.set_point(40'000);
    std::vector<std::int64_t> seen;
    for (const Time until : {Time{77'700}, Time{123'456}, Time{300'000}, Time{1'000'000}}) {
      for (; look != 0 && bench.now + look < until; bench.pass(look)) {
      }
      bench.pass(until - bench.now);
      for (const std::uint16_t index : std::array<std::uint16_t, 4>{0x6064, 0x606C, 0x6077, 0x60F4})
        seen.push_back(bench.get(index));
      if (until == 123'456) bench.set_point(-1'000);
    }
    if (known.empty()) known = seen;
    CHECK(seen == known);
  }
}

}  // namespace cbcan::test

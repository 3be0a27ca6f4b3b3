// SPDX-License-Identifier: MIT
// The cyclic synchronous modes, and profile torque.
#include "drive_bench.hpp"

namespace cbcan::test {

TEST_CASE("Profile torque: the slope, the limit, halt") {
  DriveBench bench;
  bench.enable(4, {{0x6071, 0, 500}, {0x6087, 0, 1'000}});
  bench.pass(250'000).shows({.status = kEnabled, .objects = {{0x6077, 250}}});
  bench.pass(250'000).shows({.status = kEnabled | kReached, .objects = {{0x6074, 500}}});
  bench.put(0x6072, 0, 300);
  bench.update();
  bench.pass(200'000).shows({.status = kEnabled | kReached | kLimit, .objects = {{0x6077, 300}}});
  bench.control(0x010F);
  bench.pass(300'000).shows({.objects = {{0x6077, 0}}});
  bench.control(0x0000).shows({.position = 0, .objects = {{0x6077, 0}}});
}

TEST_CASE("Cyclic position: straight lines between the set-points of SYNCs; the last one holds") {
  DriveBench bench;
  bench.put(0x6007, 0, 0);  // no action for a missed SYNC
  bench.enable(8, {{0x60C2, 1, 10}}).shows({.status = kEnabled | kBit12});
  bench.set(0x607A, 0, 1'000);
  bench.pass(kSecond).shows({.position = 0});
  bench.sync();
  bench.pass(2'500).shows({.position = 250, .velocity = 100'000});
  bench.pass(7'500).shows({.position = 1'000});
  bench.set(0x607A, 0, 3'000);
  bench.sync();
  bench.pass(5'000).shows({.position = 2'000});
  bench.pass(kSecond).shows({.position = 3'000, .velocity = 0});
  bench.put(0x60B0, 0, 50);
  bench.sync();
  bench.pass(10'000).shows({.position = 3'050});
}

TEST_CASE("Cyclic modes: SYNCs faster than 60C2h do not restart a set-point") {
  struct Row {
    std::int8_t mode;
    std::uint16_t set_point, shown;
    std::int64_t value;
  };
  for (const auto& [mode, set_point, shown, value] :
       {Row{8, 0x607A, 0x6064, 10'000}, Row{9, 0x60FF, 0x606C, 100'000}, Row{10, 0x6071, 0x6077, 500}}) {
    CAPTURE(int{mode});
    DriveBench bench;
    bench.enable(mode, {{0x60C2, 1, 50}, {set_point, 0, value}});
    const auto cycles = [&bench](int count) {
      for (; count > 0; --count)
        bench.sync().pass(10'000);
    };
    cycles(2);
    CHECK(bench.get(shown) == value * 2 / 5);
    cycles(3);
    CHECK(bench.get(shown) == value);
    bench.put(set_point, 0, 0);
    cycles(1);
    CHECK(bench.get(shown) == value * 4 / 5);
    bench.set(0x6060, 0, 0).set(0x6060, 0, mode);  // entering the mode again starts again
    bench.put(set_point, 0, value);
    bench.pass(kSecond);
    cycles(5);
    CHECK(bench.get(shown) == value);
  }
}

TEST_CASE("Cyclic position: the end of a line is waited for only where the position leaves its range") {
  DriveBench bench;
  bench.put(0x6007, 0, 0);
  bench.enable(8, {{0x60C2, 1, 10}, {0x607B, 1, 0}, {0x607B, 2, 999}});
  bench.set(0x607A, 0, 999);
  bench.sync();
  CHECK(bench.deadline == kNever);
  bench.pass(10'000).shows({.position = 999});
  bench.set(0x607A, 0, 1'004);
  bench.sync();
  CHECK(bench.deadline == bench.now + 10'000);
  bench.pass(10'000).shows({.position = 4});
}

TEST_CASE("Cyclic modes: SYNCs that have come at the period of 60C2h are missed after three periods") {
  struct Row {
    int option;  // 6007h
    unsigned status;
    std::int64_t error_code;
  };
  for (const int mode : {8, 9, 10}) {
    for (const Row& row :
         {Row{0, kEnabled | kBit12, 0}, {1, 0x0218, 0x8700}, {2, 0x0250, 0}, {3, 0x0250, 0}}) {
      INFO("mode " << mode << ", 6007h = " << row.option);
      DriveBench bench;
      bench.enable(static_cast<std::int8_t>(mode), {{0x60C2, 1, 10}, {0x6007, 0, row.option}});
      bench.sync();
      bench.pass(20'000);  // one period late is still in time
      bench.sync();
      bench.pass(29'999).shows({.status = kEnabled | kBit12});
      CHECK(bench.log.empty());
      bench.pass(1);
      CHECK(bench.log == std::vector<std::string>{"8700/10"});
      CHECK(bench.get(0x603F) == row.error_code);
      bench.pass(kSecond);
      CHECK((bench.status() & ~0x0400u) == row.status);
      CHECK(bench.log.size() == 1);
      bench.sync();
      CHECK(bench.log == std::vector<std::string>{"8700/10", "8700 over"});
    }
  }
}

TEST_CASE("Cyclic modes: a SYNC that is slower than 60C2h, or of another mode, is not missed") {
  DriveBench bench;
  bench.enable(8, {{0x60C2, 1, 10}});
  for (int i = 0; i < 3; ++i) {
    bench.sync();
    bench.pass(20'001);
  }
  bench.pass(kSecond);
  bench.set(0x60C2, 1, 0);
  bench.sync();
  bench.sync();
  bench.pass(kSecond);
  bench.set(0x60C2, 1, 10);
  bench.set(0x6060, 0, 3);
  bench.sync();
  bench.pass(10'000);
  bench.sync();
  bench.pass(kSecond);
  bench.set(0x6060, 0, 8);
  bench.sync();
  bench.pass(10'000);
  bench.sync();
  bench.control(0x0006);
  bench.pass(kSecond);
  CHECK(bench.log.empty());
}

TEST_CASE("Cyclic position: a period of 0 is at once, at the SYNC") {
  DriveBench bench;
  bench.enable(8, {{0x60C2, 1, 0}});
  bench.set(0x607A, 0, 1'000);
  bench.sync().shows({.position = 1'000});
}

TEST_CASE("Cyclic position: no further than 607Dh, no faster than 607Fh") {
  DriveBench bench;
  bench.enable(8, {{0x607D, 1, -100}, {0x607D, 2, 100}, {0x607A, 0, 400}});
  bench.sync().shows({.status = kEnabled | kBit12 | kLimit});
  bench.pass(1'000).shows({.position = 100});
  bench.put({{0x607D, 1, 0}, {0x607D, 2, 0}});
  bench.set(0x607A, 0, 10'000);
  bench.sync();
  bench.pass(1'000).shows({.position = 600});  // 500,000/s for 1 ms
}

TEST_CASE("Cyclic velocity: an even change, then the velocity goes on") {
  DriveBench bench;
  bench.enable(9, {{0x60C2, 1, 10}, {0x60FF, 0, 10'000}});
  bench.sync();
  bench.pass(5'000).shows({.velocity = 5'000});
  bench.pass(5'000).shows({.position = 50});
  bench.pass(kSecond).shows({.status = kEnabled | kBit12, .position = 10'050, .velocity = 10'000});
}

TEST_CASE("Cyclic velocity: it stops at a software limit without further SYNCs") {
  DriveBench bench;
  bench.enable(9, {{0x607D, 1, -5'000}, {0x607D, 2, 5'000}, {0x60FF, 0, 10'000}});
  bench.sync();
  bench.pass(10 * kSecond).shows({.position = 5'000});
  bench.sync().shows({.status = kEnabled | kBit12 | kLimit});
}

TEST_CASE("Cyclic velocity: a limit switch stops it between SYNCs, with software limits or without") {
  for (const int limit : {0, 900'000}) {
    INFO(limit);
    DriveBench bench;
    bench.enable(9, {{0x607D, 2, limit}, {0x60FF, 0, 100'000}});
    bench.sync();
    bench.pass(kSecond);
    bench.incident("limit-switch-positive", true);
    bench.pass(25'000).shows({.status = kEnabled | kBit12 | kLimit, .velocity = 0});
    bench.put(0x60FF, 0, -100'000);
    bench.sync();
    bench.pass(2 * kSecond).shows({.velocity = limit == 0 ? -100'000 : 0});  // 607Dh then begins at 0
  }
}

TEST_CASE("Cyclic torque") {
  DriveBench bench;
  bench.enable(10, {{0x60C2, 1, 10}, {0x6071, 0, 200}, {0x60B2, 0, 100}});
  bench.sync();
  bench.pass(5'000).shows({.objects = {{0x6077, 150}}});
  bench.pass(kSecond).shows({.status = kEnabled | kBit12, .objects = {{0x6077, 300}}});
}

TEST_CASE("The interpolation period is 60C2h:1 times ten to the 60C2h:2 seconds") {
  DriveBench bench;
  devices::DriveObjects objects(bench.objects);
  struct Row {
    int value, exponent;
    Time period;
  };
  for (const Row& row : {Row{1, -3, 1'000}, Row{250, -6, 250}, Row{20, -4, 2'000}, Row{2, 0, 2'000'000},
                         Row{255, 127, 3'600'000'000}, Row{255, -7, 25}, Row{0, 127, 0}, Row{255, -128, 0}}) {
    bench.put({{0x60C2, 1, row.value}, {0x60C2, 2, row.exponent}});
    CHECK(devices::interpolation_period(objects) == row.period);
  }
}

}  // namespace cbcan::test

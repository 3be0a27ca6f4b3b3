// SPDX-License-Identifier: MIT
// Homing, method by method. The axis: negative limit at -100,000, positive limit at 100,000, home switch from
// 20,500 to 24,500, an index pulse every 10,000. Homes calculated by hand from the drawings of CiA 402.

#include "drive_bench.hpp"

namespace cbcan::test {

namespace {

constexpr devices::AxisLayout kLayout{-100'000, 100'000, 20'500, 24'500, 50'000};

constexpr unsigned kIdle = 0x0400;
constexpr unsigned kAttained = 0x1400;
constexpr unsigned kMovingError = 0x2000;
constexpr unsigned kError = 0x2400;

/// A drive in homing mode, at rest at this place; homing has not moved the zero of position yet.
struct Home : DriveBench {
  explicit Home(std::int64_t place) : DriveBench(kLayout) {
    enable(1);
    put(0x607A, 0, place);
    control(0x001F);
    pass(10 * kSecond);
    control(0x000F);
    set(0x6060, 0, 6);
    REQUIRE(position() == place);
    REQUIRE(status() == (kEnabled | kIdle));
  }
  void start(int method) {
    put(0x6098, 0, method);
    control(0x001F);
  }
  /// The machine coordinate of the axis: homing does not change it.
  std::int64_t place() {
    return sim::rounded<std::int32_t>(drive.axis().to_machine(drive.axis().actual(now).position));
  }
};

struct HomingRow {
  int method;
  std::int64_t from_left, from_switch, from_right;  ///< home, started at 0, 22,000 and 60,000
};

constexpr std::int64_t kNone = -1;

}  // namespace

TEST_CASE("Every homing method, from the left of the home switch, from within and from the right") {
  constexpr std::array<HomingRow, 30> kRows = {{
      {1, -90'000, -90'000, -90'000},
      {2, 90'000, 90'000, 90'000},
      // 3 and 4 search for the switch to the right, 5 and 6 to the left; beyond it there is only the limit.
      {3, 20'000, 20'000, kNone},
      {4, 30'000, 30'000, kNone},
      {5, kNone, 30'000, 30'000},
      {6, kNone, 20'000, 20'000},
      {7, 20'000, 20'000, 20'000},
      {8, 30'000, 30'000, 30'000},
      {9, 20'000, 20'000, 20'000},
      {10, 30'000, 30'000, 30'000},
      {11, 30'000, 30'000, 30'000},
      {12, 20'000, 20'000, 20'000},
      {13, 30'000, 30'000, 30'000},
      {14, 20'000, 20'000, 20'000},
      {17, -100'000, -100'000, -100'000},
      {18, 100'000, 100'000, 100'000},
      {19, 20'500, 20'500, kNone},
      {20, 20'500, 20'500, kNone},
      {21, kNone, 24'500, 24'500},
      {22, kNone, 24'500, 24'500},
      {23, 20'500, 20'500, 20'500},
      {24, 20'500, 20'500, 20'500},
      {25, 24'500, 24'500, 24'500},
      {26, 24'500, 24'500, 24'500},
      {27, 24'500, 24'500, 24'500},
      {28, 24'500, 24'500, 24'500},
      {29, 20'500, 20'500, 20'500},
      {30, 20'500, 20'500, 20'500},
      {35, 0, 22'000, 60'000},
      {37, 0, 22'000, 60'000},
  }};
  for (const HomingRow& row : kRows) {
    const std::array<std::array<std::int64_t, 2>, 3> starts = {
        {{0, row.from_left}, {22'000, row.from_switch}, {60'000, row.from_right}}};
    for (const auto& [from, home] : starts) {
      INFO("method " << row.method << " from " << from);
      Home bench(from);
      bench.start(row.method);
      bench.pass(60 * kSecond);
      if (home == kNone) {
        CHECK(bench.status() == (kEnabled | kError));
        continue;
      }
      CHECK(bench.status() == (kEnabled | kAttained));
      CHECK(bench.place() == home);
      CHECK(bench.position() == 0);
    }
  }
}

TEST_CASE("Homing on the next index pulse, also from on top of one") {
  for (const auto& [method, from, home] : {std::array<int, 3>{33, 22'000, 20'000},
                                           {34, 22'000, 30'000},
                                           {33, 20'000, 10'000},
                                           {34, 20'000, 30'000},
                                           {33, -5'000, -10'000},
                                           {34, -5'000, 0}}) {
    INFO("method " << method << " from " << from);
    Home bench(from);
    bench.start(method);
    bench.pass(60 * kSecond).shows({.status = kEnabled | kAttained});
    CHECK(bench.place() == home);
  }
}

TEST_CASE("Reserved homing methods are refused, and an error where no SDO brought them") {
  Home bench(0);
  for (const int method : {15, 16, 31, 32, 38, 127, -5, -128}) {
    INFO(method);
    CHECK(bench.write(0x6098, 0, method) == AbortCode::kValue);
  }
  for (const int method : {0, 1, 14, 17, 30, 33, 34, 35, 36, 37, -1, -2, -3, -4})
    CHECK(bench.write(0x6098, 0, method) == AbortCode::kNone);
  bench.start(31);
  CHECK(bench.status() == (kEnabled | kError));
}

TEST_CASE("The home switch is within position limits that are narrower than its place") {
  DriveBench bench;
  bench.put({{0x607D, 1, -1'000}, {0x607D, 2, 1'000}});
  bench.drive.reset(true, bench.now);
  bench.enable(1, {{0x607A, 0, 790}}).control(0x001F).pass(10 * kSecond);
  bench.shows({.position = 790, .objects = {{0x60FD, 0}}});
  bench.control(0x000F).set(0x607A, 0, 810).control(0x001F).pass(10 * kSecond);
  bench.shows({.position = 810, .objects = {{0x60FD, 4}}});
}

TEST_CASE("Hard stops, 50,000 beyond the limit switches: at them, or at the next index pulse off them") {
  for (const auto& [method, home] :
       {std::pair{-1, 140'000}, {-2, -140'000}, {-3, 150'000}, {-4, -150'000}, {36, -150'000}}) {
    INFO(method);
    Home bench(22'000);
    bench.start(method);
    bench.pass(60 * kSecond).shows({.status = kEnabled | kAttained});
    CHECK(bench.place() == home);
    CHECK(bench.position() == 0);
  }
}

TEST_CASE("Method 0, no homing: nothing moves, and it is attained") {
  Home bench(22'000);
  bench.put(0x607C, 0, 1'500);
  bench.start(0);
  CHECK(bench.status() == (kEnabled | kAttained));
  bench.pass(kSecond);
  CHECK(bench.place() == 22'000);
  CHECK(bench.position() == 22'000);
}

TEST_CASE("Homing goes on after halt, wherever it was") {
  for (const Time until :
       {Time{0}, Time{200'000}, Time{2'700'000}}) {  // the last: on its way to the index pulse
    INFO(until);
    Home bench(0);
    bench.start(1);
    bench.pass(until);
    bench.control(0x011F);
    bench.pass(kSecond).shows({.status = kEnabled | kIdle, .velocity = 0});
    bench.control(0x001F).shows({.status = kEnabled});
    bench.pass(60 * kSecond).shows({.status = kEnabled | kAttained});
    CHECK(bench.place() == -90'000);
  }
}

TEST_CASE("Homing that is commanded in halt begins when halt is over") {
  Home bench(0);
  bench.put(0x6098, 0, 17);
  bench.control(0x011F);
  bench.pass(kSecond).shows({.status = kEnabled | kIdle});
  bench.control(0x001F);
  bench.pass(60 * kSecond).shows({.status = kEnabled | kAttained});
}

TEST_CASE("The zero of position is the home offset further than the home") {
  Home bench(0);
  bench.put(0x607C, 0, 1'500);
  bench.start(34);
  CHECK(bench.status() == kEnabled);
  bench.pass(kSecond + 9'999);  // 10,000 at 10,000/s, and half of each ramp of 10 ms
  CHECK(bench.status() == kEnabled);
  bench.pass(1).shows({.status = kEnabled | kAttained, .position = -1'500, .objects = {{0x6063, -1'500}}});
  bench.control(0x000F).shows({.status = kEnabled | kAttained});
}

TEST_CASE("A search: fast to the switch, slowly off it, at the speeds of 6099h") {
  Home bench(-70'000);
  bench.start(17);
  bench.pass(100'000).shows({.velocity = -50'000});
  // 0.05 s and 1,250, then 28,750 at 50,000/s: the switch at 0.625 s; then 1,250 more to stop.
  bench.pass(525'000);
  CHECK(bench.place() == -100'000);
  CHECK(bench.get(0x60FD) == 0x1);
  bench.pass(50'000);
  CHECK(bench.place() == -101'250);
  bench.pass(50'000).shows({.velocity = 10'000});
  bench.pass(kSecond);
  CHECK(bench.place() == -100'000);
  CHECK(bench.status() == (kEnabled | kAttained));
}

TEST_CASE("An edge that has to be found from outside: past it, back out, and slowly to it") {
  Home bench(0);
  bench.start(24);
  // 1,250 to speed up; 20,500 after 0.435 s; 1,250 more to turn, and back past 20,500 after 0.535 s.
  bench.pass(485'000);
  CHECK(bench.place() == 21'750);
  CHECK(bench.get(0x60FD) == 0x4);
  bench.pass(50'000).shows({.velocity = -50'000});
  bench.pass(50'000);
  CHECK(bench.place() == 19'250);
  bench.pass(50'000).shows({.velocity = 10'000});
  bench.pass(kSecond);
  CHECK(bench.place() == 20'500);
  CHECK(bench.status() == (kEnabled | kAttained));
}

TEST_CASE("Homing does not start towards a limit switch that is active") {
  Home bench(0);
  bench.incident("limit-switch-positive", true);
  bench.start(18);
  CHECK(bench.status() == (kEnabled | kError));
  bench.control(0x000F);
  bench.start(17);
  bench.pass(10 * kSecond).shows({.status = kEnabled | kAttained});
}

TEST_CASE("Homing is interrupted by bit 4, by halt and by another mode") {
  for (const std::uint16_t word : {std::uint16_t{0x000F}, std::uint16_t{0x011F}}) {
    Home bench(0);
    bench.start(17);
    bench.pass(200'000);
    bench.control(word).shows({.status = kEnabled});
    bench.pass(50'000).shows({.status = kEnabled | kIdle});
    bench.control(0x000F);
    bench.pass(kSecond).shows({.velocity = 0});
    bench.control(0x001F);
    bench.pass(10 * kSecond).shows({.status = kEnabled | kAttained});
  }
  Home bench(0);
  bench.start(17);
  bench.pass(200'000);
  bench.set(0x6060, 0, 3);
  bench.set(0x6060, 0, 6);
  bench.pass(kSecond).shows({.status = kEnabled | kIdle});
}

TEST_CASE("A limit switch in the way, or a motor that was blocked, is an error of homing") {
  Home bench(0);
  bench.start(18);
  bench.pass(200'000);
  bench.incident("limit-switch-positive", true).shows({.status = kEnabled | kMovingError});
  bench.pass(kSecond).shows({.status = kEnabled | kError});
  Home blocked(0);
  blocked.put(0x6065, 0, 0xFFFFFFFF);
  blocked.start(18);
  blocked.pass(200'000);
  blocked.incident("motor-blocked", true);
  blocked.pass(10'000);
  blocked.incident("motor-blocked", false);
  blocked.pass(kSecond);
  CHECK(blocked.status() == (kEnabled | kError));
}

}  // namespace cbcan::test

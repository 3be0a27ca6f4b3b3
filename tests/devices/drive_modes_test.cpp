// SPDX-License-Identifier: MIT
// Profile position and profile velocity, on the EDS's ramps: 1,000,000/s^2 up and down, quick stop
// 4,000,000/s^2, profile velocity 100,000/s.
#include "drive_bench.hpp"

namespace cbcan::test {

namespace {

// Statusword bit 13 in position modes.
constexpr unsigned kFollowingError = 0x2000;

}  // namespace

TEST_CASE("Modes: those of 6502h are taken over, others refused with 0609 0030h") {
  DriveBench bench;
  for (const int mode : {0, 1, 2, 3, 4, 6, 7, 8, 9, 10}) {
    CHECK(bench.write(0x6060, 0, mode) == AbortCode::kNone);
    CHECK(bench.get(0x6061) == mode);
  }
  for (const int mode : {5, 11, 33, 127, -1, -128})
    CHECK(bench.write(0x6060, 0, mode) == AbortCode::kValue);
  bench.set(0x6060, 0, 5).shows({.objects = {{0x6061, 10}}});  // by RPDO
  bench.put(0x6502, 0, 0x01);
  CHECK(bench.write(0x6060, 0, 3) == AbortCode::kValue);
}

TEST_CASE("Profile position: a set-point, its handshake, and the target reached") {
  DriveBench bench;
  bench.enable(1).shows({.status = kEnabled | kReached});
  bench.put(0x607A, 0, 50'000);
  bench.control(0x001F).shows({.status = kEnabled | kBit12});
  bench.control(0x000F).shows({.status = kEnabled});
  // 0.1 s and 5,000 up, 0.4 s and 40,000 at 100,000/s, 0.1 s and 5,000 down.
  bench.pass(100'000).shows({.position = 5'000, .velocity = 100'000});
  bench.pass(250'000).shows({.position = 30'000, .objects = {{0x6062, 30'000}}});
  bench.pass(249'999).shows({.status = kEnabled});
  bench.pass(1).shows({.status = kEnabled | kReached, .position = 50'000, .objects = {{0x6063, 50'000}}});
  bench.shows({.velocity = 0, .objects = {{0x60FC, 50'000}}});
  CHECK(bench.deadline == kNever);
}

TEST_CASE("Profile position: the position window's time") {
  DriveBench bench;
  bench.enable(1, {{0x6068, 0, 20}});
  bench.set_point(50'000);
  bench.pass(619'999).shows({.status = kEnabled});
  bench.pass(1).shows({.status = kEnabled | kReached});
}

TEST_CASE("Profile position: one set-point waits, a third is not acknowledged") {
  DriveBench bench;
  bench.enable(1);
  bench.set_point(50'000);
  bench.set_point(20'000);
  CHECK(bench.status() == (kEnabled | kBit12));  // no room for another
  bench.set_point(-99'000);
  bench.pass(600'000).shows({.status = kEnabled, .position = 50'000});
  bench.pass(400'000).shows({.status = kEnabled | kReached, .position = 20'000});
}

TEST_CASE("Profile position: change set immediately, also backwards") {
  DriveBench bench;
  bench.enable(1);
  bench.set_point(50'000);
  bench.pass(200'000).shows({.position = 15'000});
  bench.set_point(10'000, 0x20);
  bench.pass(100'000).shows({.position = 20'000, .velocity = 0});
  bench.pass(200'000).shows({.status = kEnabled | kReached, .position = 10'000});
}

TEST_CASE("Profile position: relative set-points count from the one before") {
  DriveBench bench;
  bench.enable(1);
  bench.set_point(10'000, 0x40);
  bench.pass(kSecond);
  bench.set_point(10'000, 0x40);
  bench.pass(50'000);
  bench.set_point(-5'000, 0x40 | 0x20);
  bench.pass(kSecond).shows({.position = 15'000});
}

TEST_CASE("Profile position: change on set-point passes the first at its velocity") {
  DriveBench bench;
  bench.enable(1);
  bench.set_point(20'000);
  bench.put(0x6081, 0, 50'000);
  bench.set_point(40'000, 0x200);
  // 0.1 s and 5,000, then 15,000 at 100,000/s: passed after 0.25 s.
  bench.pass(249'990).shows({.velocity = 100'000});
  bench.pass(10).shows({.position = 20'000, .velocity = 100'000});
  bench.pass(100'000).shows({.velocity = 50'000});
  bench.pass(kSecond).shows({.status = kEnabled | kReached, .position = 40'000});
}

TEST_CASE("Profile position: change on set-point stops where the next is too near or lies back") {
  for (const int next : {24'999, 20'000, -20'000}) {
    INFO(next);
    DriveBench bench;
    bench.enable(1);
    bench.set_point(20'000);
    bench.set_point(next, 0x200);
    bench.pass(300'000).shows({.position = 20'000, .velocity = 0});
    bench.pass(kSecond).shows({.position = next});
  }
}

TEST_CASE("Profile position: halt, and on again") {
  for (const int option : {1, 2, 3, 4}) {
    INFO(option);
    DriveBench bench;
    bench.enable(1, {{0x605D, 0, option}});
    bench.set_point(50'000);
    bench.pass(200'000);
    bench.control(0x010F);
    bench.pass(option == 1 ? 99'999 : 24'999).shows({.status = kEnabled});
    bench.pass(1).shows({.status = kEnabled | kReached, .position = option == 1 ? 20'000 : 16'250});
    bench.control(0x000F).shows({.status = kEnabled});
    bench.pass(kSecond).shows({.position = 50'000});
  }
}

TEST_CASE("Profile position: targets are kept within the software limits") {
  DriveBench bench;
  bench.enable(1, {{0x607D, 1, -1'000}, {0x607D, 2, 3'000}});
  bench.set_point(5'000);
  CHECK(bench.status() == (kEnabled | kLimit));
  bench.pass(kSecond).shows({.position = 3'000});
  bench.set_point(-2'000);
  bench.pass(kSecond).shows({.position = -1'000});
  bench.set_point(0);
  bench.pass(kSecond).shows({.status = kEnabled | kReached, .position = 0});
}

TEST_CASE("Profile position: a limit switch stops the axis; the other way is free") {
  DriveBench bench;
  bench.enable(1);
  bench.set_point(50'000);
  bench.pass(200'000);
  bench.incident("limit-switch-positive", true).shows({.objects = {{0x60FD, 0x2}}});
  bench.pass(25'000).shows({.status = kEnabled | kLimit, .position = 16'250});
  bench.set_point(0, 0x20);
  bench.pass(kSecond).shows({.position = 0});
  bench.set_point(1'000);
  bench.pass(kSecond).shows({.position = 0});
  bench.incident("limit-switch-positive", false);
  bench.pass(kSecond).shows({.position = 1'000});
}

TEST_CASE("The axis stops at its own limit switch, and leaves it the other way") {
  DriveBench bench({-15'000, 15'000, 200'000, 250'000});
  bench.enable(1);
  bench.set_point(50'000);
  bench.pass(225'000).shows({.position = 16'250});  // 15,000 after 0.2 s, then 1,250 to stop
  bench.shows({.status = kEnabled | kLimit, .objects = {{0x60FD, 0x2}}});
  bench.pass(kSecond).shows({.position = 16'250});
  bench.set_point(-50'000, 0x20);
  bench.pass(kSecond).shows({.status = kEnabled | kLimit, .position = -16'250, .objects = {{0x60FD, 0x1}}});
  bench.set_point(0, 0x20);
  bench.pass(kSecond).shows({.position = 0, .objects = {{0x60FD, 0}}});
}

TEST_CASE("Without limit switches an axis has no ends; homing takes them to be far away") {
  DriveBench bench;
  bench.enable(3, {{0x60FF, 0, 100'000}});
  bench.pass(100 * kSecond).shows({.position = 9'995'000, .velocity = 100'000, .objects = {{0x60FD, 0}}});
  CHECK((bench.status() & kLimit) == 0);
  bench.set(0x60FF, 0, -100'000);
  bench.pass(300 * kSecond).shows({.velocity = -100'000, .objects = {{0x60FD, 0}}});
  DriveBench other;
  other.enable(6, {{0x6098, 0, 17}});
  other.control(0x001F);
  other.pass(60 * kSecond).shows({.status = kEnabled | kReached | kBit12, .objects = {{0x60FD, 0}}});
  CHECK(other.drive.axis().to_machine(0) == -1'000'000);
}

TEST_CASE("One limit switch alone: the other side is open") {
  DriveBench bench({{}, 15'000});
  bench.enable(1);
  bench.set_point(50'000);
  bench.pass(kSecond).shows({.position = 16'250, .objects = {{0x60FD, 0x2}}});
  bench.set_point(-2'000'000, 0x20);
  bench.pass(60 * kSecond).shows({.status = kEnabled | kReached, .position = -2'000'000});
}

TEST_CASE("At velocity too: own limit switches stop the axis") {
  DriveBench bench({-15'000, 15'000, 200'000, 250'000});
  bench.enable(3);
  bench.set(0x60FF, 0, 100'000);
  bench.pass(kSecond).shows({.position = 16'250});
  CHECK((bench.status() & kLimit) == kLimit);
  bench.set(0x60FF, 0, -100'000);
  bench.pass(kSecond).shows({.position = -16'250});
}

TEST_CASE("An axis that goes round, with 607Bh in force, has no limit switches") {
  DriveBench bench({-15'000, 15'000, 200'000, 250'000});
  bench.enable(1, {{0x607B, 1, 0}, {0x607B, 2, 9'999}});
  bench.set_point(50'000);
  bench.pass(5 * kSecond).shows({.status = kEnabled | kReached, .position = 0, .objects = {{0x60FD, 0}}});
}

TEST_CASE("60FDh is an event when it changes, at the place where it does") {
  DriveBench bench({-15'000, 15'000, 5'000, 6'000});
  const auto inputs_changed = [&] {
    const auto count = std::count(bench.events.begin(), bench.events.end(), 0x60FD);
    bench.events.clear();
    return count;
  };
  bench.enable(1);
  bench.set_point(10'000);
  CHECK(inputs_changed() == 0);
  bench.pass(100'000).shows({.objects = {{0x60FD, 0x4}}});  // 5,000
  CHECK(inputs_changed() == 1);
  bench.pass(kSecond).shows({.objects = {{0x60FD, 0}}});
  CHECK(inputs_changed() == 1);
  bench.set_point(0);
  bench.pass(kSecond);
  CHECK(inputs_changed() == 2);
  bench.incident("limit-switch-negative", true);
  CHECK(inputs_changed() == 1);
}

TEST_CASE(
    "Current follows torque: 6078h in thousandths of 6075h, within 6073h; 6079h is the voltage of the link") {
  DriveBench bench;
  CHECK(bench.get(0x6079) == 48'000);
  bench.enable(4);
  bench.set(0x6071, 0, 700);
  bench.pass(kSecond).shows({.objects = {{0x6077, 700}, {0x6078, 700}}});
  bench.set(0x6073, 0, 500);
  bench.pass(kSecond).shows({.objects = {{0x6074, 500}, {0x6078, 500}}});
  CHECK((bench.status() & kLimit) == kLimit);
  bench.incident("undervoltage", true).shows({.objects = {{0x6079, 24'000}}});
  bench.incident("undervoltage", false);
  bench.incident("overvoltage", true).shows({.objects = {{0x6079, 72'000}}});
  bench.incident("overvoltage", false).shows({.objects = {{0x6079, 48'000}}});
}

TEST_CASE("60FEh bit 0 is the brake: with its bit in the mask it holds the axis") {
  DriveBench bench;
  bench.enable(1, {{0x6065, 0, 0xFFFFFFFF}});
  bench.set(0x60FE, 1, 1);
  bench.set_point(1'000);
  bench.pass(kSecond).shows({.position = 1'000});
  bench.set(0x60FE, 2, 1);
  bench.set_point(2'000);
  bench.pass(kSecond).shows({.position = 1'000});
  bench.set(0x60FE, 1, 0);
  bench.pass(kSecond).shows({.position = 2'000});
}

TEST_CASE("Profile position: 607Fh and 6080h bound the velocity") {
  DriveBench bench;
  bench.enable(1, {{0x607F, 0, 40'000}});
  bench.set_point(500'000);
  bench.pass(kSecond).shows({.velocity = 40'000});
  bench.put(0x6080, 0, 60);  // one revolution per second, 10,000 increments
  bench.set_point(400'000, 0x20);
  bench.pass(kSecond).shows({.velocity = 10'000});
}

TEST_CASE("A blocked motor: the following error grows, is shown, and becomes a fault") {
  DriveBench bench;
  bench.enable(1, {{0x6065, 0, 2'000}, {0x6066, 0, 10}});
  bench.set_point(50'000);
  bench.pass(200'000);
  bench.incident("motor-blocked", true);
  bench.pass(20'000).shows({.position = 15'000, .velocity = 0});  // 2,000 at 100,000/s
  bench.shows({.status = kEnabled, .objects = {{0x60F4, 2'000}}});
  bench.pass(10'000).shows({.status = kEnabled});  // the time-out, 6066h, has not expired
  bench.pass(1).shows({.status = 0x021F | kFollowingError});
  CHECK(bench.log == std::vector<std::string>{"8611/21"});
  bench.pass(25'000).shows({.status = 0x0218 | kFollowingError, .objects = {{0x60F4, 0}}});
  CHECK(bench.position() == 15'000);
  bench.control(0x0080).shows({.status = 0x0250});
  bench.incident("motor-blocked", false).shows({.status = 0x0250});
  CHECK(bench.log == std::vector<std::string>{"8611/21", "8611 over"});
}

TEST_CASE("A motor freed in time continues from its position") {
  DriveBench bench;
  bench.enable(1, {{0x6065, 0, 0xFFFFFFFF}});
  bench.set_point(50'000);
  bench.pass(200'000);
  bench.incident("motor-blocked", true);
  bench.pass(kSecond).shows({.status = kEnabled, .objects = {{0x60F4, 35'000}}});
  bench.incident("motor-blocked", false).shows({.position = 15'000});
  bench.pass(450'000).shows({.position = 50'000});  // 0.1 s, 25,000 at 100,000/s, 0.1 s
  CHECK(bench.status() == (kEnabled | kReached));
}

TEST_CASE("Profile velocity: ramps, windows, standstill") {
  DriveBench bench;
  bench.enable(3, {{0x606E, 0, 10}, {0x6070, 0, 10}});
  bench.pass(10'000).shows({.status = kEnabled | kReached | kBit12});
  bench.set(0x60FF, 0, 100'000).shows({.status = kEnabled});
  bench.pass(50'000).shows({.position = 1'250, .velocity = 50'000, .objects = {{0x606B, 50'000}}});
  bench.pass(59'999).shows({.status = kEnabled});
  bench.pass(1).shows({.status = kEnabled | kReached, .velocity = 100'000});
  bench.set(0x60FF, 0, -100'000);
  bench.pass(200'000).shows({.status = kEnabled, .velocity = -100'000});
  bench.pass(10'000).shows({.status = kEnabled | kReached});
}

TEST_CASE("Profile velocity: halt, and what is more than 607Fh") {
  DriveBench bench;
  bench.enable(3, {{0x60FF, 0, 900'000}});
  bench.pass(kSecond).shows({.velocity = 500'000});
  CHECK((bench.status() & kLimit) != 0);
  bench.control(0x010F);
  bench.pass(499'999);
  CHECK((bench.status() & kReached) == 0);
  bench.pass(1).shows({.velocity = 0});
  CHECK((bench.status() & (kReached | kBit12)) == (kReached | kBit12));
}

TEST_CASE("Profile velocity: it stops at a software limit and leaves it the other way") {
  DriveBench bench;
  bench.enable(3, {{0x607D, 1, -30'000}, {0x607D, 2, 30'000}, {0x60FF, 0, 100'000}});
  bench.pass(200'000).shows({.status = kEnabled | kReached, .velocity = 100'000});
  bench.pass(kSecond).shows({.status = kEnabled | kLimit | kBit12, .position = 30'000});
  bench.set(0x60FF, 0, -100'000);
  bench.pass(10 * kSecond).shows({.position = -30'000});
}

TEST_CASE("An endless axis wraps at INTEGER32, or at 607Bh") {
  DriveBench bench({-1e12, 1e12, 200'000, 250'000});
  bench.enable(3, {{0x60FF, 0, 100'000}, {0x607B, 1, 0}, {0x607B, 2, 35'999}});
  bench.pass(kSecond).shows({.position = 23'000});  // 95,000 = 2 * 36,000 + 23,000
  bench.put({{0x607B, 1, 0}, {0x607B, 2, 0}});
  bench.pass(30'000 * kSecond).shows({.position = -1'294'944'296});  // 3,000,023,000 - 4,294,967,296
  CHECK(bench.velocity() == 100'000);
}

TEST_CASE("A mode changed in motion: what cannot take it over stops it") {
  DriveBench bench;
  bench.put(0x60FF, 0, 100'000);
  for (const int mode : {0, 1, 4, 6, 8, 9, 10}) {
    INFO(mode);
    bench.put(0x6060, 0, 3);
    bench.control(0x0006);
    bench.control(0x000F);
    bench.pass(kSecond);
    REQUIRE(bench.velocity() == 100'000);
    bench.set(0x6060, 0, mode).shows({.velocity = 100'000});
    bench.pass(100'000).shows({.velocity = 0});
  }
}

}  // namespace cbcan::test

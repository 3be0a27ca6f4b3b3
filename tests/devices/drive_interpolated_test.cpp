// SPDX-License-Identifier: MIT
// Interpolated position (ip).
#include "drive_bench.hpp"

namespace cbcan::test {

TEST_CASE("Interpolated position: the last point at each SYNC while controlword bit 4 is 1") {
  DriveBench bench;
  bench.put(0x6007, 0, 0);
  bench.enable(7, {{0x60C2, 1, 10}, {0x60C1, 1, 1'000}}).shows({.status = kEnabled | kReached});
  bench.sync().pass(kSecond).shows({.position = 0});
  bench.control(0x001F).shows({.status = kEnabled | kBit12 | kReached});
  bench.pass(kSecond).shows({.position = 0});  // nothing without SYNC
  bench.sync().shows({.status = kEnabled | kBit12});
  bench.pass(2'500).shows({.position = 250, .velocity = 100'000});
  bench.pass(7'500).shows({.position = 1'000});
  bench.set(0x60C1, 1, -500).sync().pass(5'000).shows({.position = 250, .velocity = -150'000});
  bench.control(0x000F).shows({.status = kEnabled});
  // -150,000/s at 1,000,000/s2: 150 ms and 11,250 increments.
  bench.pass(150'000).shows({.status = kEnabled | kReached, .position = -11'000});
  bench.sync().pass(kSecond).shows({.position = -11'000});
}

TEST_CASE("Interpolated position: SYNCs of 10 ms with a period of 50 ms") {
  DriveBench bench;
  bench.enable(7, {{0x60C2, 1, 50}}).control(0x001F);
  bench.set(0x60C1, 1, 5'000);
  for (int cycle = 1; cycle <= 5; ++cycle)
    bench.sync().pass(10'000).shows({.position = 1'000 * cycle, .velocity = cycle < 5 ? 100'000 : 0});
  bench.set(0x60C1, 1, 5'500).sync().pass(10'000).shows({.position = 5'100});
  bench.set(0x60C1, 1, 6'000).sync().pass(10'000).shows({.position = 5'280});  // from there in 50 ms
  bench.pass(40'000).shows({.status = kEnabled | kBit12 | kReached, .position = 6'000});
}

TEST_CASE("Interpolated position: target reached, while SYNCs go on") {
  DriveBench bench;
  bench.enable(7, {{0x60C2, 1, 10}}).control(0x001F).set(0x60C1, 1, 1'000);
  for (int cycle = 0; cycle < 3; ++cycle)
    bench.sync().pass(10'000);
  bench.sync().shows({.status = kEnabled | kBit12 | kReached, .position = 1'000});
  bench.pass(5'000).shows({.status = kEnabled | kBit12 | kReached, .position = 1'000});
}

TEST_CASE("Interpolated position: halt, the position limits, the greatest velocity, a SYNC that is missed") {
  DriveBench bench;
  bench.enable(7, {{0x60C2, 1, 10}, {0x607D, 1, -400}, {0x607D, 2, 2'000}, {0x605D, 0, 2}}).control(0x001F);
  bench.set(0x60C1, 1, 9'000).sync().shows({.status = kEnabled | kBit12 | kLimit});
  bench.pass(10'000).shows({.status = kEnabled | kBit12 | kLimit | kReached, .position = 2'000});
  bench.put({{0x607D, 1, 0}, {0x607D, 2, 0}, {0x607F, 0, 100'000}});
  bench.sync().pass(10'000).shows({.position = 3'000});
  bench.sync().pass(5'000).control(0x011F).shows({.status = kEnabled | kLimit});
  bench.pass(25'000).shows({.status = kEnabled | kLimit | kReached, .position = 4'750});  // 4,000,000/s2
  bench.control(0x001F).sync().pass(10'000).sync().pass(29'999);
  CHECK(bench.log.empty());
  bench.pass(1);
  CHECK(bench.log == std::vector<std::string>{"8700/10"});
}

TEST_CASE("Interpolated position: a buffer of points, one a period and without SYNC") {
  DriveBench bench;
  bench.enable(7, {{0x60C2, 1, 10}, {0x60C4, 2, 4}});
  for (const int point : {1'000, 1'500, 1'500, 3'000})
    bench.set(0x60C1, 1, point);  // by RPDO, where the same value is no further point
  CHECK(bench.write(0x60C1, 1, 3'000) == AbortCode::kNone);  // by SDO it is
  bench.set(0x60C1, 1, 9'000);                               // no room
  bench.sync().pass(kSecond).shows({.status = kEnabled, .position = 0});
  CHECK(bench.get(0x60C4, 4) == 4);
  bench.control(0x001F).pass(5'000).shows({.status = kEnabled | kBit12, .position = 500});
  bench.pass(5'000).shows({.position = 1'000}).sync();
  bench.pass(5'000).shows({.position = 1'250, .velocity = 50'000});
  bench.pass(5'000).shows({.position = 1'500});
  bench.pass(10'000).shows({.status = kEnabled | kBit12, .position = 3'000});
  CHECK(bench.get(0x60C4, 4) == 0);
  bench.pass(10'000).shows({.status = kEnabled | kBit12 | kReached, .position = 3'000});
  bench.set(0x60C1, 1, 4'000).pass(2'500).shows({.status = kEnabled | kBit12, .position = 3'250});
  bench.set(0x60C1, 1, 5'000);
  CHECK(bench.write(0x60C4, 6, 0) == AbortCode::kNone);  // the buffer is cleared
  CHECK(bench.write(0x60C4, 2, 9) == AbortCode::kValueHigh);  // 60C4h:01 is 8
  CHECK(bench.write(0x60C4, 2, 0xFFFFFFFF) == AbortCode::kValueHigh);
  CHECK(bench.write(0x60C4, 2, 8) == AbortCode::kNone);
  bench.pass(kSecond).shows({.status = kEnabled | kBit12 | kReached, .position = 4'000});
  CHECK(bench.log.empty());
}

}  // namespace cbcan::test

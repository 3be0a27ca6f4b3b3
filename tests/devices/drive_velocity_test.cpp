// SPDX-License-Identifier: MIT
// Velocity mode (vl) of frequency inverters: 10,000 increments a revolution, ramps of 6000 1/min in 1 s,
// which is 1,000,000/s^2; quick stop four times as steep.
#include "drive_bench.hpp"

namespace cbcan::test {

TEST_CASE("Velocity mode: the target by the ramps 6048h and 6049h, also backwards") {
  DriveBench bench;
  bench.enable(2, {{0x6042, 0, 300}}).shows({.status = kEnabled, .objects = {{0x6061, 2}}});
  bench.pass(25'000).shows({.velocity = 25'000, .objects = {{0x6043, 150}, {0x6044, 150}}});
  bench.pass(25'000).shows({.status = kEnabled, .position = 1'250, .objects = {{0x6044, 300}}});
  bench.pass(100'000).shows({.position = 6'250, .velocity = 50'000});
  bench.put(0x6049, 1, 3'000);
  bench.set(0x6042, 0, -300).pass(50'000).shows({.velocity = 25'000});
  bench.pass(50'000).shows({.position = 8'750, .velocity = 0});
  bench.pass(25'000).shows({.velocity = -25'000, .objects = {{0x6043, -150}}});
  bench.pass(kSecond).shows({.status = kEnabled, .objects = {{0x6044, -300}}});
  bench.put(0x6049, 2, 0);  // no time: without a ramp
  bench.set(0x6042, 0, 0).shows({.velocity = 0});
}

TEST_CASE("Velocity mode: ramp bits 4, 5 and 6 of the controlword count from the first one that is set") {
  DriveBench bench;
  bench.enable(2, {{0x6042, 0, 300}}).pass(kSecond).shows({.objects = {{0x6044, 300}}});
  bench.control(0x007F).pass(kSecond).shows({.objects = {{0x6044, 300}}});
  bench.control(0x005F)
      .set(0x6042, 0, 100)
      .pass(kSecond)
      .shows({.status = kEnabled, .objects = {{0x6044, 300}}});
  bench.control(0x007F).pass(10'000).shows({.velocity = 40'000});
  bench.control(0x005F).pass(kSecond).shows({.velocity = 40'000, .objects = {{0x6043, 240}}});
  bench.control(0x003F).pass(10'000).shows({.velocity = 30'000});
  bench.pass(30'000).shows({.status = kEnabled, .velocity = 0});
  bench.control(0x007F).pass(kSecond).shows({.objects = {{0x6044, 100}}});
  bench.control(0x006F).pass(2'000).shows({.velocity = 16'667 - 8'000});  // 604Ah
  bench.pass(kSecond).shows({.status = kEnabled, .velocity = 0});
  bench.control(0x000F).pass(kSecond).shows({.status = kEnabled, .velocity = 0});
  bench.control(0x0006).control(0x000F).pass(kSecond).shows({.velocity = 0});
  bench.control(0x007F).pass(kSecond).control(0x005F).shows({.objects = {{0x6044, 100}}});
  bench.control(0x0006).pass(kSecond).control(0x005F).pass(kSecond).shows({.velocity = 0});  // locked at rest
  bench.drive.reset(true, bench.now);
  bench.control(0x0000).control(0x0006).control(0x000F).pass(kSecond).shows({.objects = {{0x6044, 100}}});
}

TEST_CASE("Velocity mode: the amounts of 6046h, motor speed and position limits set bit 11") {
  struct Row {
    int target, reached;
    unsigned status;
  };
  for (const auto& [target, reached, status] : {Row{300, 200, kEnabled | kLimit},
                                                {-300, -200, kEnabled | kLimit},
                                                {50, 100, kEnabled | kLimit},
                                                {-1, -100, kEnabled | kLimit},
                                                {150, 150, kEnabled},
                                                {0, 0, kEnabled}}) {
    CAPTURE(target);
    DriveBench bench;
    bench.enable(2, {{0x6046, 1, 100}, {0x6046, 2, 200}, {0x6042, 0, target}});
    bench.pass(kSecond).shows({.status = status, .objects = {{0x6044, reached}}});
  }
  DriveBench bench;
  bench.enable(2, {{0x6080, 0, 120}, {0x6042, 0, 300}});
  bench.pass(kSecond).shows({.status = kEnabled | kLimit, .velocity = 20'000});
  bench.put({{0x6080, 0, 0}, {0x607D, 1, -1}, {0x607D, 2, 50'000}});
  bench.update().pass(kSecond).shows({.status = kEnabled | kLimit, .position = 50'000});
  bench.set(0x6042, 0, -60).pass(100'000).shows({.status = kEnabled, .velocity = -10'000});
}

TEST_CASE("Velocity mode: the factors of set-point and dimension") {
  DriveBench bench;
  // 6042h = 1000 is 2000 tenths of 1/min.
  bench.enable(2, {{0x604B, 1, 2}, {0x604C, 2, 10}, {0x6046, 2, 1'500}, {0x6042, 0, 1'000}});
  bench.pass(kSecond).shows({.status = kEnabled | kLimit, .velocity = 25'000});  // 150 1/min
  bench.shows({.objects = {{0x6043, 750}, {0x6044, 750}}});
  bench.put(0x6046, 2, 0);
  bench.update().pass(kSecond).shows({.status = kEnabled, .velocity = 33'333});
  bench.set(0x604B, 1, -2).pass(kSecond).shows({.velocity = -33'333, .objects = {{0x6044, 1'000}}});
  bench.set(0x604B, 2, 0).pass(kSecond).shows({.velocity = 16'667});  // 0 is no factor
}

TEST_CASE("Velocity mode: halt, quick stop and disabled operation use its ramps") {
  for (const auto& [option, rate] : {std::pair{1, 500'000}, {2, 4'000'000}}) {
    CAPTURE(option);
    DriveBench bench;
    bench.enable(2, {{0x605D, 0, option}, {0x6049, 1, 3'000}, {0x6042, 0, 300}}).pass(kSecond);
    bench.control(0x010F).pass(10'000).shows({.velocity = 50'000 - rate / 100});
    bench.pass(kSecond).shows({.status = kEnabled, .velocity = 0});
    bench.control(0x000F).pass(kSecond).shows({.velocity = 50'000});
    bench.control(0x0007).pass(20'000).shows({.status = kEnabled, .velocity = 40'000});
    bench.pass(80'000).shows({.status = 0x0233, .velocity = 0});
  }
  DriveBench bench;
  bench.enable(2, {{0x6042, 0, 300}}).pass(kSecond);
  bench.control(0x000B).pass(10'000).shows({.status = 0x0217, .velocity = 10'000});
  bench.pass(2'500).shows({.status = 0x0250, .velocity = 0});
}

TEST_CASE("Velocity mode: a limit switch stops the axis, which moves only away from it") {
  DriveBench bench;
  bench.enable(2, {{0x6042, 0, 300}}).pass(kSecond);
  bench.incident("limit-switch-positive", true)
      .pass(12'500)
      .shows({.status = kEnabled | kLimit, .velocity = 0});
  bench.set(0x6042, 0, -300).pass(50'000).shows({.status = kEnabled, .velocity = -50'000});
}

TEST_CASE("Velocity mode: with a load, the motor lags by the torque that the ramp takes") {
  DriveBench bench({.load = {.inertia = 10, .friction = 50}});
  bench.enable(2, {{0x6048, 1, 600}, {0x6042, 0, 300}});
  // 100,000/s2 are 62.8 rad/s2, with 10 kg cm2 and friction 113 mNm of 1,000; the lag is 100,000 / 188^2.
  bench.pass(300'000).shows({.objects = {{0x6077, 113}, {0x60F4, 3}}});
  bench.pass(kSecond).shows({.velocity = 50'000, .objects = {{0x6077, 50}, {0x6044, 300}, {0x60F4, 0}}});
}

}  // namespace cbcan::test

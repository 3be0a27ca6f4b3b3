// SPDX-License-Identifier: MIT
// Times of PDOs at any time of the clock: Pdo keeps them in 32 bits, counted from an epoch that moves on.

#include "core/pdo_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

/// When it is first used, and when the epoch moves: 2^31 us after it, or 2^27 less if it has moved already.
struct Clock {
  Time start;
  Time moves;
};
constexpr Clock kClocks[] = {
    {1000, 0x8000'0000},
    {0x10'0000'0000'0000, 0x10'0000'7800'0000},      // from 2^52
    {0x7FFF'FFFF'0000'0000, 0x7FFF'FFFF'7800'0000},  // up to 2^63 and above
    {0xFFFF'0000'0000'0000, 0xFFFF'0000'7800'0000},
};

/// TPDO 1 every 40 ms, TPDO 2 not within 80 ms, RPDO 1 within 60 ms: Operational so long before the epoch
/// moves. Returns when it does.
Time run(PdoRig& rig, Time before) {
  const Clock clock = kClocks[GENERATE(0, 1, 2, 3)];
  rig.now = clock.start;
  rig.operational();
  rig.operational(false);
  rig.configure({{0x1800, 5, 40}, {0x1801, 3, 800}, {0x1400, 5, 60}});
  rig.set_up(0x1800, 1, 0x181, 254, {0x20010108});
  rig.set_up(0x1800, 2, 0x182, 255, {0x20010208});
  rig.set_up(0x1400, 1, 0x201, 255, {0x20010308});
  rig.now = clock.moves - before;
  rig.operational().expect("181#00", "182#00");
  rig.arrive("201#07").expect("received");
  return clock.moves;
}

Wire& poll_at(PdoRig& rig, Time time) {
  rig.now = time;
  rig.pdo.poll(time);
  return rig;
}

}  // namespace

TEST_CASE("Timers, inhibit times and deadlines are exact when the epoch moves meanwhile") {
  PdoRig rig;
  const Time moves = run(rig, 50'000);
  rig.pdo.request(2, rig.now);
  rig.pass(39'999).expect_silence();
  rig.pass(1).expect("181#00");
  poll_at(rig, moves - 1).expect_silence();
  CHECK(rig.pdo.deadline() == moves + 10'000);
  poll_at(rig, moves).expect_silence();
  CHECK(rig.pdo.deadline() == moves + 10'000);
  rig.pass(9'999).expect_silence();
  rig.pass(1).expect("error 8250 of 1");
  rig.pass(19'999).expect_silence();
  rig.pass(1).expect("181#00", "182#00");
  rig.pass(39'999).expect_silence();
  rig.pass(1).expect("181#00");
}

TEST_CASE("An event timer polled late when the epoch moves does not drift") {
  PdoRig rig;
  const Time moves = run(rig, 50'000);
  poll_at(rig, moves + 5'000).expect("181#00");
  CHECK(rig.pdo.deadline() == moves + 10'000);
  rig.pass(5'000).expect("error 8250 of 1");
  CHECK(rig.pdo.deadline() == moves + 30'000);
}

TEST_CASE("A frame that the port refuses is tried again on time when the epoch moves meanwhile") {
  PdoRig rig;
  const Time moves = run(rig, 80'050);
  rig.pass(80'000).expect("181#00", "error 8250 of 1", "181#00");
  rig.port.refuse_next = 1;
  rig.pdo.request(2, rig.now);
  rig.pdo.request(1, rig.now);
  poll_at(rig, moves).expect_silence();
  rig.pass(49).expect_silence();
  rig.pass(1).expect("181#00", "182#00");
}

TEST_CASE("After any pause what is overdue comes once, and what was inhibited is free") {
  PdoRig rig;
  run(rig, GENERATE(Time{50'000}, Time{1}));
  const Time pause = GENERATE(kMillisecond << 21, Time{0xFFFF'FFFF}, Time{0x1'0000'0000}, Time{1} << 40);
  SECTION("with something due") {
    poll_at(rig, rig.now + pause).expect("error 8250 of 1", "181#00");
    rig.pdo.request(2, rig.now);
    rig.expect("182#00");
    rig.arrive("201#07").expect("received");
    rig.pdo.request(2, rig.now);
    rig.pass(39'999).expect_silence();
    rig.pass(1).expect("181#00");
    rig.pass(19'999).expect_silence();
    rig.pass(1).expect("error 8250 of 1");
    rig.pass(19'999).expect_silence();
    rig.pass(1).expect("181#00", "182#00");
  }
  SECTION("with nothing due") {
    rig.configure({{0x1800, 5, 0}, {0x1400, 5, 0}});
    rig.pass(60'000).expect_silence();
    CHECK(rig.pdo.deadline() == kNever);
    rig.now += pause;
    rig.pdo.look_for_changes(rig.now);
    CHECK(rig.pdo.deadline() == kNever);
    rig.pdo.request(2, rig.now);
    rig.expect("182#00");
    rig.pdo.request(2, rig.now);
    rig.pass(79'999).expect_silence();
    rig.pass(1).expect("182#00");
    CHECK(rig.pdo.deadline() == kNever);
  }
}

TEST_CASE("The longest window of 1007h is exact") {
  constexpr Time kWindow = 0xFFFF'FFFF;
  PdoRig rig;
  run(rig, 1'000);
  rig.configure({{0x1800, 1, 0x80000181}, {0x1801, 1, 0x80000182}, {0x1400, 1, 0x80000201}, {0x1402, 5, 10}});
  rig.set_up(0x1400, 2, 0x202, 1, {0x20010408});
  rig.set_up(0x1400, 3, 0x203, 1, {0x20010508});
  rig.set_up(0x1800, 3, 0x40000183, 1, {0x20010608});
  rig.port.refuse_next = 2;
  rig.sync(0, kWindow).expect_silence();
  const bool in_time = GENERATE(true, false);
  const Time end = rig.now + kWindow + (in_time ? 0 : 1);
  rig.now += kWindow / 2;
  rig.pdo.poll(rig.now);  // refused again
  rig.now = end;
  for (const char* frame : {"202#02", "203#03"})  // before a poll that is due
    rig.pdo.on_frame(frame_from(frame), rig.now);
  rig.pdo.poll(rig.now);
  if (in_time) rig.expect("183#00");
  rig.sync(0, kWindow).expect("183#00");
  rig.shows({{0x2001, 4, in_time ? 2u : 0u}, {0x2001, 5, in_time ? 3u : 0u}});
}

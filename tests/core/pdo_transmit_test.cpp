// SPDX-License-Identifier: MIT
// TPDOs: what makes them be sent, for every transmission type; timers, SYNC window, a port that refuses.

#include "core/pdo_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

constexpr std::uint32_t kNoRtr = 0x40000000;

}  // namespace

TEST_CASE("Types 254 and 255: sent on becoming Operational, then on events") {
  PdoRig rig;
  rig.set_up(0x1800, 1, kNoRtr + 0x181, 254, {0x20010108});
  rig.set_up(0x1800, 3, kNoRtr + 0x183, 255, {0x20010108, 0x20000201});
  rig.change(0x2001, 1, 0x10);  // not yet Operational
  rig.pdo.request(1, rig.now);
  CHECK(rig.pdo.deadline() == kNever);
  rig.operational().expect("181#10", "183#1000");
  rig.operational().expect_silence();  // it is already
  rig.change(0x2001, 1, 0x11).expect("181#11", "183#1100");
  rig.change(0x2000, 2, 1).expect("183#1101");
  rig.change(0x2001, 2, 1);  // not mapped
  rig.change(0x2000, 1, 1);
  rig.pdo.changed(0x2001, 9, rig.now);  // not there
  rig.pdo.changed(0x2012, 0, rig.now);  // without a place
  rig.sync();
  rig.arrive("181#R1").expect_silence();  // RTR not allowed
  rig.pdo.request(3, rig.now);
  rig.expect("183#1101");
  rig.pdo.request(2, rig.now);  // not valid
  rig.pdo.request(4, rig.now);  // not there
  rig.pdo.request(0, rig.now);
  rig.pass(1000 * kMillisecond);
  rig.operational(false);
  rig.change(0x2001, 1, 0x12).expect_silence();
}

TEST_CASE("Inhibit time: events within it are one frame at its end, with the values of then") {
  PdoRig rig;
  rig.configure(0x1800, 3, 50);  // 5 ms
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  rig.operational().expect("181#00");
  rig.pass(1'000);
  rig.change(0x2001, 1, 1);
  rig.pass(1'000);
  rig.change(0x2001, 1, 2);
  rig.arrive("181#R0");
  rig.set(0x2001, 1, 3);
  rig.pass(2'999).expect_silence();
  rig.pass(1).expect("181#03");
  rig.pass(4'999);
  rig.change(0x2001, 1, 4).expect_silence();
  rig.pass(1).expect("181#04");
  rig.pass(5'000);
  rig.change(0x2001, 1, 5).expect("181#05");
  rig.change(0x2001, 1, 6);
  rig.operational(false);  // forgets it
  rig.pass(100'000);
  rig.operational().expect("181#06");
  rig.operational(false);  // and the inhibit time
  rig.operational().expect("181#06");
  rig.pass(100'000).expect_silence();
}

TEST_CASE("Event timer: starts anew with each transmission, without drift") {
  PdoRig rig;
  rig.configure(0x1800, 5, 10);
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  rig.operational().expect("181#00");
  rig.pass(9'999).expect_silence();
  rig.pass(1).expect("181#00");
  rig.pass(4'000);
  rig.change(0x2001, 1, 1).expect("181#01");
  rig.pass(9'999).expect_silence();
  rig.pass(1).expect("181#01");
  rig.now += 10'700;  // a late poll
  rig.pdo.poll(rig.now);
  rig.expect("181#01");
  rig.pass(9'299).expect_silence();
  rig.pass(1).expect("181#01");
  rig.now += 100'000;  // a very late one: no burst
  rig.pdo.poll(rig.now);
  rig.expect("181#01");
  rig.pass(9'999).expect_silence();
}

TEST_CASE("Event timer shorter than the inhibit time; neither for other types") {
  PdoRig rig;
  rig.configure({{0x1800, 3, 250}, {0x1800, 5, 10}});
  rig.set_up(0x1800, 1, 0x181, 254, {0x20010108});
  rig.configure({{0x1801, 3, 250}, {0x1801, 5, 10}});
  rig.set_up(0x1800, 2, 0x182, 1, {0x20010108});
  rig.configure(0x1802, 5, 10);
  rig.set_up(0x1800, 3, 0x183, 253, {0x20010108});
  rig.operational().expect("181#00");
  for (int i = 0; i < 3; ++i) {
    rig.pass(24'999).expect_silence();
    rig.pass(1).expect("181#00");
  }
  for (int i = 0; i < 3; ++i)
    rig.sync().expect("182#00");
}

TEST_CASE("Type 0: at the SYNC after an event") {
  PdoRig rig;
  rig.set_up(0x1800, 1, kNoRtr + 0x181, 0, {0x20010108});
  rig.operational();
  rig.sync().expect_silence();
  rig.change(0x2001, 1, 1);
  rig.set(0x2001, 1, 2).expect_silence();
  rig.sync().expect("181#02");
  rig.sync();
  rig.pdo.request(1, rig.now);
  rig.expect_silence();
  rig.sync().expect("181#02");
  rig.pdo.request(1, rig.now);
  rig.operational(false);
  rig.operational();
  rig.sync();
  CHECK(rig.pdo.deadline() == kNever);
}

TEST_CASE("SYNC start value: the SYNC with that counter is the first") {
  PdoRig rig;
  rig.configure(0x1800, 6, 3);
  rig.set_up(0x1800, 1, kNoRtr + 0x181, 2, {0x20010108});
  rig.configure(0x1801, 6, 2);
  rig.set_up(0x1800, 2, kNoRtr + 0x182, 1, {0x20010108});
  rig.operational();
  rig.sync(1).expect_silence();
  rig.sync(2).expect("182#00");
  rig.sync(3).expect("182#00");
  rig.sync(4).expect("181#00", "182#00");
  rig.sync(1).expect("182#00");
  rig.sync(2).expect("181#00", "182#00");
  rig.operational(false);
  rig.operational();  // waits anew
  rig.sync(1).expect_silence();
  rig.sync().expect("182#00");  // without a counter there is nothing to wait for
  rig.sync().expect("181#00", "182#00");
}

TEST_CASE("Type 252: sampled at the SYNC, sent on RTR") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x181, 252, {0x20010108});
  rig.set(0x2001, 1, 1);
  rig.arrive("181#R1");  // not Operational
  rig.operational().expect_silence();
  rig.set(0x2001, 1, 2);
  rig.arrive("181#R1").expect("181#01");  // before the first SYNC
  rig.sync().expect_silence();
  rig.change(0x2001, 1, 3);
  rig.arrive("181#R8").expect("181#02");
  rig.arrive("181#", "182#R1").expect_silence();
}

TEST_CASE("RTR for the other types: event-driven ones as they are, synchronous ones as at the last SYNC") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  rig.set_up(0x1800, 2, 0x182, 2, {0x20010108});
  rig.set_up(0x1800, 3, kNoRtr + 0x183, 1, {0x20010108});
  rig.set_up(0x1800, 5, 0x184, 0, {0x20010108});
  rig.operational().expect("181#00");
  rig.sync().expect("183#00");
  rig.set(0x2001, 1, 1);
  rig.sync().expect("182#01", "183#01");
  rig.set(0x2001, 1, 2);
  rig.arrive("181#R1").expect("181#02");
  rig.arrive("182#R1").expect("182#01");
  rig.arrive("183#R1", "184#R1").expect("184#00");
  rig.sync(0, 100).expect("183#02");
  rig.pass(200);
  rig.port.refuse_next = 1;
  rig.arrive("182#R1");  // a response may also come after the window
  rig.pass(100).expect("182#01");
}

TEST_CASE("SYNC: RPDOs take effect, then the application, then TPDOs in the order of their numbers") {
  PdoRig rig;
  rig.set_up(0x1800, 5, kNoRtr + 0x181, 1, {0x20010108});
  rig.set_up(0x1800, 2, kNoRtr + 0x185, 1, {0x20010208});
  rig.set_up(0x1400, 1, 0x201, 1, {0x20010108});
  rig.operational();
  rig.log_sampling = true;
  rig.in_reception = [&] { rig.set(0x2001, 1, rig.get(0x2001, 1) + 1); };
  rig.in_sampling = [&] { rig.set(0x2001, 2, rig.get(0x2001, 1) * 2); };
  rig.arrive("201#10");
  rig.sync().expect("synchronised", "sampling", "185#22", "181#11");
}

TEST_CASE("The application is brought up to date once for all that is sampled, and not for what is not") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  rig.set_up(0x1800, 2, 0x182, 255, {0x20010108});
  rig.set_up(0x1800, 3, 0x183, 3, {0x20010108});
  rig.operational().expect("181#00", "182#00");
  rig.log_sampling = true;
  rig.change(0x2001, 1, 1).expect("sampling", "181#01", "182#01");
  rig.sync().expect("synchronised");
  rig.sync().expect("synchronised");
  rig.arrive("183#R1").expect("183#00");
  rig.sync().expect("synchronised", "sampling", "183#01");
}

TEST_CASE("Events that the application has while it is being called are sent when it has returned") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  rig.set_up(0x1800, 2, 0x182, 255, {0x20010208});
  rig.set_up(0x1400, 1, 0x201, 255, {0x20010308});
  rig.operational().expect("181#00", "182#00");
  SECTION("before sampling: with what is sampled, in order, and nothing of it again") {
    rig.in_sampling = [&] {
      rig.change(0x2001, 1, 7);
      rig.change(0x2001, 2, 8);
    };
    rig.pdo.request(2, rig.now);
    rig.expect("181#07", "182#08");
  }
  SECTION("on reception") {
    rig.in_reception = [&] {
      rig.change(0x2001, 1, rig.get(0x2001, 3));
      rig.port.sent.push_back("returns");
    };
    rig.arrive("201#09").expect("received", "returns", "181#09");
  }
  CHECK(rig.pdo.deadline() == kNever);
}

TEST_CASE("What the port refuses is tried again 100 us later, in order; event-driven ones as they are then") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  rig.set_up(0x1800, 2, 0x182, 1, {0x20010108});
  rig.set_up(0x1800, 3, 0x183, 1, {0x20010108});
  rig.operational().expect("181#00");
  rig.set(0x2001, 1, 1);
  rig.port.tries = 0;
  rig.port.refuse_next = 1;
  rig.sync();
  CHECK(rig.port.tries == 1);  // 3 does not overtake 2
  rig.change(0x2001, 1, 2);    // nor does 1, later
  rig.change(0x2001, 1, 3);
  rig.arrive("183#R1");
  CHECK(rig.port.tries == 1);
  CHECK(rig.pdo.deadline() == rig.now + 100);
  rig.set(0x2001, 1, 4);
  rig.pass(99).expect_silence();
  rig.pass(1).expect("181#04", "182#01", "183#01");
  rig.pass(1000);
  CHECK(rig.pdo.deadline() == kNever);
}

TEST_CASE("A port that stays full: one frame of each at most, the latest; nothing after Operational") {
  PdoRig rig;
  rig.configure(0x1800, 5, 1);
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  rig.set_up(0x1800, 2, 0x182, 1, {0x20010108});
  rig.port.refuse_next = RecordingPort::kAlways;
  rig.operational();
  for (unsigned i = 1; i <= 5; ++i) {
    rig.set(0x2001, 1, i);
    rig.sync();
    rig.pass(950);
  }
  rig.port.refuse_next = 0;
  rig.pass(100).expect("181#05", "182#05");
  rig.port.refuse_next = 2;
  rig.sync();
  rig.change(0x2001, 1, 6);
  rig.operational(false);
  rig.pass(10'000).expect_silence();
  rig.port.refuse_next = 1;
  rig.operational().expect_silence();
  rig.operational(false);
  rig.operational().expect("181#06");  // without waiting for the time to try again
}

TEST_CASE("A synchronous TPDO that becomes event-driven has no window any more") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x181, 1, {0x20010108});
  rig.operational();
  rig.sync(0, 100).expect("181#00");
  rig.configure({{0x1800, 2, 255}, {0x1800, 5, 10}});
  rig.pass(10'000).expect("181#00");
}

TEST_CASE("Synchronous TPDOs that the port does not take within the window are dropped") {
  PdoRig rig;
  rig.set_up(0x1800, 1, kNoRtr + 0x181, 1, {0x20010108});
  rig.set_up(0x1800, 2, kNoRtr + 0x182, 2, {0x20010108});
  rig.set_up(0x1800, 3, kNoRtr + 0x183, 255, {0x20010108});
  rig.operational().expect("183#00");
  rig.sync(0, 250).expect("181#00");
  SECTION("within it") {
    rig.port.refuse_next = 2;
    rig.sync(0, 250);
    rig.pass(200).expect("181#00", "182#00");
  }
  SECTION("behind it") {
    rig.port.refuse_next = 3;
    rig.sync(0, 250);
    rig.change(0x2001, 1, 1);
    rig.pass(300).expect("183#01");
    rig.pass(1'000);
  }
  SECTION("behind it when the next SYNC comes first") {
    rig.port.refuse_next = 1;
    rig.sync(0, 50);
    rig.pdo.request(3, rig.now);  // knows no window
    rig.pass(60);
    rig.set(0x2001, 1, 2);
    rig.sync(0, 250);
    rig.pass(1'000).expect("181#02", "183#02");
  }
}

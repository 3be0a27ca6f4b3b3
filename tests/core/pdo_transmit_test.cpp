// SPDX-License-Identifier: MIT
// TPDOs: when they are sent, for every transmission type; timers, SYNC window, a port that refuses frames.

#include "core/pdo_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

constexpr std::uint32_t kNoRtr = 0x40000000;

}  // namespace

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
    rig.pdo.request(3, rig.now);  // not limited by the window
    rig.pass(60);
    rig.set(0x2001, 1, 2);
    rig.sync(0, 250);
    rig.pass(1'000).expect("181#02", "183#02");
  }
}

TEST_CASE("A TPDO that the port has refused does not hold up the next start, nor an RTR behind the window") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x181, 255, {0x20010108});
  rig.set_up(0x1800, 2, 0x182, 2, {0x20010108});
  rig.port.refuse_next = 1;
  rig.operational().expect_silence();
  rig.operational(false);
  rig.operational().expect("181#00");  // without waiting for the time to try again
  rig.sync();
  rig.sync().expect("182#00");
  rig.sync(0, 100);
  rig.pass(200);
  rig.port.refuse_next = 1;
  rig.arrive("182#R1");
  rig.pass(100).expect("182#00");
}

TEST_CASE("SYNC start value: without a counter there is nothing to wait for") {
  PdoRig rig;
  rig.configure({{0x1800, 6, 240}, {0x1800, 6, 3}});
  rig.set_up(0x1800, 1, kNoRtr + 0x181, 1, {0x20010108});
  rig.operational();
  rig.sync(2).expect_silence();
  rig.sync().expect("181#00");
}

TEST_CASE("What is not there, not mapped, not valid or not Operational means nothing") {
  PdoRig rig;
  rig.set_up(0x1800, 1, kNoRtr + 0x181, 254, {0x20010108});
  rig.set_up(0x1800, 3, 0x183, 255, {0x20010208});
  rig.change(0x2001, 1, 0x10);  // not yet Operational
  rig.pdo.request(1, rig.now);
  rig.operational().expect("181#10", "183#00");
  rig.configure(0x1802, 1, 0x80000183);
  rig.change(0x2001, 2, 1).expect_silence();
  rig.pdo.changed(0x2001, 9);
  rig.pdo.changed(0x2012, 0);  // computed
  for (std::uint16_t number = 2; number <= 4; ++number)
    rig.pdo.request(number, rig.now);
  rig.arrive("181#R1", "183#R1");
  rig.sync().expect_silence();
}

// SPDX-License-Identifier: MIT
// RPDOs: when data takes effect, what is rejected, deadline monitoring.

#include "core/pdo_rig.hpp"

using cbcan::kMillisecond;
using cbcan::test::PdoRig;

TEST_CASE("Synchronous RPDOs behind the window are ignored until the next SYNC") {
  PdoRig rig;
  rig.set_up(0x1400, 1, 0x201, 1, {0x20010108});
  rig.set_up(0x1400, 2, 0x202, 255, {0x20010208});
  rig.operational();
  rig.arrive("201#01");  // no SYNC yet: no window either
  rig.sync(0, 500);
  rig.pass(500);
  rig.arrive("201#02");
  rig.pass(1);
  rig.arrive("201#03");  // also not counted as too short or received
  rig.arrive("201#", "202#07").expect("received");
  rig.pass(499);
  rig.sync(0, 500);
  CHECK(rig.get(0x2001, 1) == 2);
  rig.pass(501);
  rig.sync(0, 0);  // no window: any time
  rig.pass(100'000);
  rig.arrive("201#04");
  rig.sync();
  CHECK(rig.get(0x2001, 1) == 4);
}

TEST_CASE("What waits for the SYNC is forgotten with Operational, and with a change of the PDO") {
  PdoRig rig;
  rig.set_up(0x1400, 1, 0x201, 1, {0x20010108});
  rig.operational();
  rig.arrive("201#01");
  rig.operational(false);
  rig.sync();
  rig.operational();
  rig.sync();
  rig.arrive("201#02");
  rig.configure(0x1400, 2, 2);
  rig.sync().expect_silence();
  rig.sync(0, 100);
  rig.pass(101);
  rig.operational(false);
  rig.operational();
  rig.arrive("201#03");  // so is the window
  rig.sync();
  CHECK(rig.get(0x2001, 1) == 3);
}

TEST_CASE("Event timer: 8250h once, from the first reception and again from each") {
  PdoRig rig;
  rig.set_up(0x1400, 1, 0x201, 255, {0x20020110});
  rig.set_up(0x1400, 2, 0x202, 1, {0x20010208});
  rig.configure({{0x1400, 5, 10}, {0x1401, 5, 25}});
  rig.operational();
  rig.pass(1000 * kMillisecond).expect_silence();
  rig.arrive("201#0100").expect("received");
  rig.arrive("202#02");
  rig.pass(9'999);
  rig.arrive("201#0200").expect("received");
  rig.pass(9'999);
  rig.arrive("201#03").expect("error 8210 of 1");  // not a reception
  rig.pass(1).expect("error 8250 of 1");
  rig.pass(5'000).expect_silence();
  rig.pass(1).expect("error 8250 of 2");
  rig.pass(1000 * kMillisecond).expect_silence();
  rig.arrive("201#0400").expect("received");
  rig.pass(10'000).expect("error 8250 of 1");
  rig.arrive("201#0500").expect("received");
  rig.operational(false);
  rig.pass(1000 * kMillisecond);
  CHECK(rig.pdo.deadline() == cbcan::kNever);
  rig.operational();
  rig.pass(1000 * kMillisecond);
}

TEST_CASE("What is wrong with an RPDO is over when it comes as it should or is off; with several, with all") {
  PdoRig rig;
  rig.set_up(0x1400, 1, 0x201, 255, {0x20010108});
  rig.set_up(0x1400, 2, 0x202, 1, {0x20010208});
  rig.operational();
  rig.log_recovery = true;
  rig.arrive("201#").expect("error 8210 of 1");
  rig.arrive("202#").expect("error 8210 of 2");
  rig.arrive("201#11").expect("received");
  rig.arrive("202#2233").expect("error 8220 of 2", "recovered 8210");
  rig.arrive("202#22").expect("recovered 8220");
  rig.arrive("202#").expect("error 8210 of 2");
  rig.configure(0x1401, 1, 0x80000202);
  rig.expect("recovered 8210");
}

TEST_CASE("Several RPDOs may have one COB-ID; those with the same low digits of the index are distinguished") {
  PdoRig rig;
  rig.set_up(0x1400, 1, 0x201, 1, {0x20010108});
  rig.set_up(0x1400, 2, 0x220, 1, {0x20010208});
  rig.set_up(0x1400, 3, 0x243, 1, {0x20010308});
  rig.set_up(0x1400, 5, 0x220, 1, {0x20010508});
  rig.operational();
  rig.arrive("201#11", "220#22", "243#33");
  rig.arrive("262#44");  // no RPDO has this ID, but the same place in the index
  CHECK(rig.get(0x2001, 1) == 0);
  rig.sync();
  rig.shows({{0x2001, 1, 0x11}, {0x2001, 2, 0x22}, {0x2001, 3, 0x33}, {0x2001, 5, 0x22}});
}

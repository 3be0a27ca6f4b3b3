// SPDX-License-Identifier: MIT
// What stands where in a PDO's eight bytes.

#include "core/pdo_rig.hpp"

using cbcan::test::PdoRig;

TEST_CASE("TPDO: the I/O module's inputs and first analog channel") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x400001C2, 255, {0x64010110, 0x60000108});
  rig.set({{0x6401, 1, 0x012C}, {0x6000, 1, 0x0F}});
  rig.operational().expect("1C2#2C010F");
}

TEST_CASE("TPDO: BOOLEANs take one bit each, and what follows them crosses bytes") {
  PdoRig rig;
  rig.set_up(0x1800, 1, 0x40000181, 255, {0x20000101, 0x20000201, 0x20000301});
  rig.set_up(0x1800, 2, 0x40000182, 255, {0x20000101, 0x64010110, 0x20000201, 0x60000108});
  rig.set_up(0x1800, 3, 0x40000183, 255, {0x20010108, 0x20000101});
  rig.set(0x2000, 1, 1);
  rig.set(0x2000, 3, 0xFF);  // one bit of it
  rig.set({{0x6401, 1, 0x8001}, {0x6000, 1, 0xC1}, {0x2001, 1, 0x77}});
  rig.operational().expect("181#05", "182#03000503", "183#7701");
  rig.change(0x2000, 1, 0).expect("181#04", "182#02000503", "183#7700");
}

TEST_CASE("RPDO: bits") {
  PdoRig rig;
  rig.set_up(0x1400, 1, 0x201, 255, {0x00010001, 0x20000101, 0x00020008, 0x20000201, 0x20020110, 0x20000301});
  rig.operational();
  rig.set(0x2000, 3, 1);
  // Bit 1; bit 10; 8421h << 11; bit 27.
  rig.arrive("201#020C2104").expect("received");
  rig.shows({{0x2000, 1, 1}, {0x2000, 2, 1}, {0x2002, 1, 0x8421}, {0x2000, 3, 0}});
  rig.arrive("201#FDF3DEFB").expect("received");
  rig.shows({{0x2000, 1, 0}, {0x2000, 2, 0}, {0x2002, 1, 0x7BDE}, {0x2000, 3, 1}});
}

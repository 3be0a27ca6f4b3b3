// SPDX-License-Identifier: MIT
// Configuration of PDOs by SDO: every rejection with its code, and what is allowed when.

#include "core/pdo_rig.hpp"

using namespace cbcan;
using cbcan::test::PdoRig;

using Ids = std::vector<std::uint32_t>;

TEST_CASE("Values from the start: valid PDOs work, ones whose mapping does not hold stay off") {
  PdoRig rig;
  const auto put = [&](std::uint16_t parameters, std::uint32_t cob_id, std::uint32_t mapped) {
    rig.set({{parameters, 1, cob_id}, {parameters, 2, 255}});
    rig.set({{parameters + 0x200u, 0, mapped == 0 ? 0u : 1u}, {parameters + 0x200u, 1, mapped}});
  };
  put(0x1400, 0x201, 0x20010108);
  put(0x1401, 0x301, 0);           // nothing mapped
  put(0x1402, 0x401, 0x20100008);  // not mappable
  put(0x1404, 0, 0x20010308);      // no COB-ID
  put(0x15FF, 0x501, 0x20010208);
  put(0x1800, 0x40000181, 0x20010108);
  put(0x1801, 0x281, 0x20010208);
  rig.reset();
  CHECK(rig.ids() == Ids{0x201, 0x501, 0x281});
  rig.operational().expect("181#00", "281#00");
  rig.arrive("201#11").expect("received");
  rig.arrive("501#22").expect("received");
  rig.arrive("301#", "401#33", "000#33");
  rig.shows({{0x2001, 1, 0x11}, {0x2001, 2, 0x22}, {0x2001, 3, 0}});
  rig.configure(0x1604, 0, 0);  // not valid without a usable COB-ID
  rig.reset();
  rig.arrive("201#44");
  CHECK(rig.get(0x2001, 1) == 0x11);
}

TEST_CASE("A PDO maps the objects of its mapping at the moment it becomes valid, whatever was tried before") {
  PdoRig rig;
  rig.operational();
  rig.configure(0x1400, 2, 255);
  rig.map(0x1400, 1, {0x20010108, 0x20010208});
  rig.refuse(0x1600, 0, 3, 0x06020000);  // entry 3 is 0; two entries are still mapped
  rig.configure(0x1400, 1, 0x201);
  rig.arrive("201#1122").expect("received");
  rig.shows({{0x2001, 1, 0x11}, {0x2001, 2, 0x22}});
  rig.configure(0x1400, 1, 0x80000201);
  rig.map(0x1400, 1, {0x20010308});
  rig.set({{0x1600, 0, 1}, {0x1600, 1, 0x20010408}});  // as at power-on
  rig.reset();
  rig.operational();
  rig.configure(0x1400, 1, 0x201);
  rig.arrive("201#44").expect("received");
  rig.shows({{0x2001, 3, 0}, {0x2001, 4, 0x44}});
  rig.configure(0x1400, 1, 0x80000201);
  rig.configure(0x1600, 0, 0);
  rig.refuse(0x1400, 1, 0x201, 0x08000022);  // nothing mapped any more
}

TEST_CASE("How many there are; less room than that is for the first ones") {
  PdoRig rig(2, 1);
  CHECK(Pdo::count(rig.entries, object::kRpdoParameter) == 5);
  CHECK(Pdo::count(rig.entries, object::kTpdoParameter) == 5);
  CHECK(Pdo::count({}, object::kRpdoParameter) == 0);
  rig.set_up(0x1400, 2, 0x202, 255, {0x20010108});
  rig.set_up(0x1400, 3, 0x203, 255, {0x20010108});
  rig.set_up(0x1800, 1, 0x40000181, 255, {0x20010108});
  rig.set_up(0x1800, 512, 0x40000182, 255, {0x20010108});
  CHECK(rig.ids() == Ids{0x202});
  rig.operational().expect("181#00");
  rig.arrive("203#01");
}

TEST_CASE("A PDO that becomes valid, changes or ends in Operational") {
  PdoRig rig;
  rig.operational();
  rig.set(0x2001, 1, 0x5A);
  rig.set_up(0x1800, 1, 0x40000181, 255, {0x20010108});
  rig.expect("181#5A");
  rig.configure(0x1800, 5, 10);  // the timer starts, nothing is sent
  rig.pass(9'999).expect_silence();
  rig.pass(1).expect("181#5A");
  rig.configure(0x1800, 1, 0xC0000181);
  rig.pass(50'000);
  rig.change(0x2001, 1, 1);
  rig.pdo.request(1, rig.now);
  rig.expect_silence();
  rig.set_up(0x1800, 1, 0x40000191, 255, {0x20010208});
  rig.expect("191#00");
  rig.set_up(0x1400, 1, 0x201, 255, {0x20010208});
  rig.configure({{0x1400, 1, 0x40000201}, {0x1400, 3, 200}});  // bit 30, and what has no meaning, may change
  rig.arrive("201#07").expect("received");
  CHECK(rig.get(0x2001, 2) == 7);
  rig.configure(0x1400, 1, 0x80000201);
  rig.arrive("201#08");
  CHECK(rig.get(0x2001, 2) == 7);
  rig.pass(9'000).expect_silence();
}

// SPDX-License-Identifier: MIT
// The device of docs/reference/devices.md.
#include "examples/tank.hpp"

#include "tests/devices/rig.hpp"

namespace cbcan::test {

namespace {

AbortCode check_inlet(Rig<Tank>& tank, std::uint8_t percent) {
  ObjectEntry entry{};
  REQUIRE(tank.dictionary().find(0x2001, 0, entry) == AbortCode::kNone);
  return tank.device.check(entry, 0, {&percent, 1}, tank.now);
}

eds::DictionaryImage tank_dictionary() {
  return dictionary_of({{0x2000, 0, DataType::kUnsigned16}, {0x2001, 0, DataType::kUnsigned8}});
}

}  // namespace

TEST_CASE("the example's tank fills at the rate of its inlet, with an event for each new level") {
  Rig<Tank> tank(tank_dictionary());
  CHECK(tank.next == kNever);
  tank.write(0x2001, 0, 100);
  CHECK(tank.next == tank.now + 100 * kMillisecond);
  tank.pass(200 * kMillisecond).expect("changed 2000:00", "changed 2000:00").shows(0x2000, 0, 10);
  tank.write(0x2001, 0, 0);  // at the same moment: nothing has flowed in between
  CHECK(tank.get(0x2000, 0) == 10);
  CHECK(tank.next == kNever);
  tank.reset(true).shows(0x2000, 0, 10);
}

TEST_CASE("the example's tank says that it is full, refuses more, and empties through a leak") {
  Rig<Tank> tank(tank_dictionary());
  CHECK(check_inlet(tank, 100) == AbortCode::kNone);
  tank.write(0x2001, 0, 100);
  tank.pass(20 * kSecond);
  for (int event = 0; event < 200; ++event)
    tank.expect("changed 2000:00");
  tank.expect("error FF00 81");
  CHECK(tank.get(0x2000, 0) == 1000);
  CHECK(check_inlet(tank, 100) == AbortCode::kDeviceState);
  CHECK(check_inlet(tank, 0) == AbortCode::kNone);
  tank.write(0x2001, 0, 0);
  tank.incident("leak", true);
  tank.pass(100 * kMillisecond).expect("changed 2000:00", "over FF00").shows(0x2000, 0, 999);
}

}  // namespace cbcan::test

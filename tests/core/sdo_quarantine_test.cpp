// SPDX-License-Identifier: MIT
// The quarantine by itself, as several clients would share it.
#include "cbcan/canopen/sdo/quarantine.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

constexpr sdo::Multiplexer kFirst = 0x002000, kSecond = 0x012001;

}  // namespace

TEST_CASE("quarantine: a node is held until the last of its transfers is over") {
  SdoQuarantine quarantine;
  CHECK(quarantine.empty());
  quarantine.add(5, kFirst, false, 2000);
  quarantine.add(5, kSecond, false, 3000);
  quarantine.add(6, kFirst, false, 4000);
  CHECK(!quarantine.empty());
  CHECK(quarantine.held_until(5, 1000) == 3000);
  CHECK(quarantine.held_until(7, 1000) == 1000);
  CHECK(quarantine.take(frame_from("585#4301200100000000"), 1000));  // the response of the second
  CHECK(quarantine.held_until(5, 1000) == 2000);
  CHECK(quarantine.take(frame_from("585#4300200000000000"), 1000));
  CHECK(!quarantine.take(frame_from("585#4300200000000000"), 1000));
  CHECK(quarantine.held_until(5, 1000) == 1000);
  CHECK(quarantine.held_until(6, 4000) == 4000);
  CHECK(quarantine.empty());
}

TEST_CASE("quarantine: a boot-up releases a node from all of it, and no other") {
  SdoQuarantine quarantine;
  quarantine.add(5, kFirst, true, 3000);
  quarantine.add(5, kSecond, false, 2000);
  quarantine.add(6, kFirst, false, 4000);
  CHECK(quarantine.take(frame_from("585#4300200000000000"), 1000));  // a block: time alone ends it
  CHECK(quarantine.held_until(5, 1000) == 3000);
  quarantine.release(5);
  CHECK(quarantine.held_until(5, 1000) == 1000);
  CHECK(quarantine.held_until(6, 1000) == 4000);
}

TEST_CASE("quarantine: when all places are taken others wait for the first to come free, which goes first") {
  SdoQuarantine quarantine;
  for (std::uint8_t node = 1; node <= SdoQuarantine::kSlots; ++node)
    quarantine.add(node, kFirst, false, Time{1000} * node);
  CHECK(quarantine.held_until(20, 500) == 1000);
  CHECK(quarantine.held_until(8, 500) == 8000);
  quarantine.add(9, kFirst, false, 9000);
  CHECK(quarantine.held_until(20, 500) == 2000);
  CHECK(quarantine.held_until(9, 500) == 9000);
}

}  // namespace cbcan::test

// SPDX-License-Identifier: MIT
// docs/contract.md, "Local objects: R3702 = 0": the own EMCY messages, 1003h, 1014h and 1015h.

#include "contract/pdo.hpp"

using namespace cbcan::contract;

namespace {

/// RPDO 1 with two bytes on 27Fh, RPDO 2 with two on 37Fh, and the own node in Operational.
void start_with_rpdos(Window& window) {
  set_up_pdo(window, 0x1400, 0x27F, 255, {0xA1000110});
  set_up_pdo(window, 0x1401, 0x37F, 255, {0xA1000210});
  start_own_node(window);
}

}  // namespace

TEST_CASE("[OBJ-32] the own EMCY messages") {
  Window window;
  SECTION("no 8130h") {
    window.configure(0x1016, 1, 4, {300, 5});
    start_own_node(window);
    window.arrive("705#05");
    window.pass(1s).expect_silence();
    CHECK(read_local(window, 0x3007, 5) == Value{7, 1});
    window.arrive("705#05");
  }
  SECTION("too short") {
    start_with_rpdos(window);
    window.arrive("27F#01").expect("0FF#1082110100000000");
    window.arrive("27F#02").expect_silence();  // told once
    CHECK(read_local(window, 0x1001, 0) == Value{0x11, 1});
    window.arrive("27F#0304").expect("0FF#0000000000000000");
  }
  SECTION("too long") {
    start_with_rpdos(window);
    window.arrive("37F#010203").expect("0FF#2082110200000000");
    window.arrive("37F#0102").expect("0FF#0000000000000000");
  }
  SECTION("too late") {
    window.configure(0x1400, 5, 2, {100});
    start_with_rpdos(window);
    window.pass(1s).expect_silence();  // the first has not come yet
    window.arrive("27F#0102");
    window.pass_nearly(100ms).expect_silence();
    window.pass_rest().expect("0FF#5082110100000000");
    window.pass(1s).expect_silence();
    window.arrive("27F#0102").expect("0FF#0000000000000000");
  }
  SECTION("two errors: 0000h tells what is left") {
    start_with_rpdos(window);
    window.arrive("27F#01");
    window.arrive("37F#010203").expect("0FF#1082110100000000", "0FF#2082110200000000");
    window.arrive("27F#0102").expect("0FF#0000110000000000");
    window.arrive("37F#0102").expect("0FF#0000000000000000");
  }
  CHECK(read_local(window, 0x1001, 0) == Value{0, 1});
}

TEST_CASE("[OBJ-32] bus-off") {
  Window window;
  CONTRACT_NEEDS(window, Ability::kBusState);
  window.target().set_bus_state(BusState::kBusOff);
  window.expect_silence();
  window.target().set_bus_state(BusState::kActive);
  window.expect("0FF#4081110000000000", "0FF#0000000000000000");
  CHECK(local_bytes(window, 0x1003, 1) == "40810000");
  CHECK(local_bytes(window, 0x3005, Window::kOwnNode) == "0000000000000000");
}

TEST_CASE("[OBJ-32] [OBJ-33] error passive, overflow, a SYNC of another length than 1019h says") {
  Window window;
  SECTION("SYNC") {
    set_up_pdo(window, 0x1800, 0x1FF, 1, {0xA5800110});
    start_own_node(window);
    window.arrive("080#05").expect("0FF#4082110000000000", "1FF#0000");
    window.arrive("080#").expect("0FF#0000000000000000", "1FF#0000");
  }
  SECTION("controller") {
    CONTRACT_NEEDS(window, Ability::kBusState);
    window.target().set_bus_state(BusState::kErrorPassive);
    window.expect("0FF#2081110000000000");
    window.target().set_bus_state(BusState::kActive);
    window.expect("0FF#0000000000000000");
    window.target().set_bus_state(BusState::kOverflow);
    window.expect("0FF#1081110000000000");
    window.target().set_bus_state(BusState::kActive);
    window.expect("0FF#0000000000000000");
  }
  CHECK(read_local(window, 0x1001, 0) == Value{0, 1});
}

TEST_CASE("[OBJ-9] 1003h") {
  Window window;
  CHECK(read_local(window, 0x1003, 0) == Value{0, 1});
  for (unsigned k = 0; k < 9; ++k)
    set_up_pdo(window, 0x1400 + k, 0x201 + k, 255, {0xA1000110});
  start_own_node(window);
  const char* const emcy[] = {"0FF#1082110100000000", "0FF#1082110200000000", "0FF#1082110300000000",
                              "0FF#1082110400000000", "0FF#1082110500000000", "0FF#1082110600000000",
                              "0FF#1082110700000000", "0FF#1082110800000000", "0FF#1082110900000000"};
  for (std::uint32_t k = 0; k < 9; ++k) {
    const std::string id = std::string("20") + std::to_string(k + 1);
    window.arrive(id + "#01");
    window.expect(emcy[k]);
    window.arrive(id + "#0102").expect("0FF#0000000000000000");
    CHECK(read_local(window, 0x1003, 0) == Value{std::min(k + 1, 8u), 1});
    CHECK(read_local(window, 0x1003, 1) == Value{0x00018210 + 0x10000 * k, 4});
  }
  for (std::uint16_t sub = 1; sub <= 8; ++sub)
    CHECK(read_local(window, 0x1003, sub) == Value{0x000A8210 - 0x10000u * sub, 4});
  check_missing(window, 0x1003, 9, 0x06090011);
  check_read_only(window, 0x1003, 8);
  window.write(0, 0x1003, 0, 1, {1}).check_failed(0x06090030);
  CHECK(read_local(window, 0x1003, 0) == Value{8, 1});
  window.configure(0x1003, 0, 1, {0});
  CHECK(read_local(window, 0x1003, 0) == Value{0, 1});
  window.arrive("201#01");
  window.expect(emcy[0]);
  CHECK(read_local(window, 0x1003, 0) == Value{1, 1});
  CHECK(read_local(window, 0x1003, 1) == Value{0x00018210, 4});
}

TEST_CASE("[OBJ-13] 1014h, 1015h") {
  Window window;
  CHECK(read_local(window, 0x1014, 0) == Value{0xFF, 4});
  CHECK(read_local(window, 0x1015, 0) == Value{0, 2});
  SECTION("another COB-ID: by way of invalid") {
    window.write(0, 0x1014, 0, 4, {0x3FF, 0}).check_failed(0x06090030);
    configure32(window, 0x1014, 0, 0x800000FF);
    start_with_rpdos(window);
    window.arrive("27F#01");
    window.arrive("27F#0102").expect_silence();
    configure32(window, 0x1014, 0, 0x3FF);
    CHECK(read_local(window, 0x1014, 0) == Value{0x3FF, 4});
    window.arrive("27F#01").expect("3FF#1082110100000000");
  }
  SECTION("the inhibit time") {
    window.configure(0x1015, 0, 2, {5000});
    CHECK(read_local(window, 0x1015, 0) == Value{5000, 2});
    start_with_rpdos(window);
    window.arrive("27F#01").expect("0FF#1082110100000000");
    window.arrive("37F#01020304");
    window.pass_nearly(500ms).expect_silence();
    window.pass_rest().expect("0FF#2082110200000000");
  }
}

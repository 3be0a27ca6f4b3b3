// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Local objects: R3702 = 0": EMCY messages of other nodes and of the own node.

#include "contract/pdo.hpp"

using namespace cbcan::contract;

namespace {

const std::string kNothing = "0000000000000000";
const std::string kNoStop = "000000000000000000";

void check_last(Window& window, std::uint16_t node, const std::string& message) {
  CHECK(local_bytes(window, 0x3005, node) == message);
}

/// The next stops of the scan: node ID, then the message.
template <class... Stops>
void check_stops(Window& window, const Stops&... stops) {
  const auto check = [&](const std::string& stop) { CHECK(local_bytes(window, 0x3006, 0) == stop); };
  (check(stops), ...);
}

}  // namespace

TEST_CASE("[OBJ-5] 3005h") {
  Window window;
  for (const std::uint16_t node : Words{1, 5, 126, 127})
    check_last(window, node, kNothing);
  window.arrive("085#3081110102030405", "081#1042030000000000", "0FE#FFFFFFFFFFFFFFFF");
  check_last(window, 5, "3081110102030405");
  check_last(window, 1, "1042030000000000");
  check_last(window, 126, "FFFFFFFFFFFFFFFF");
  check_last(window, 6, kNothing);
  window.arrive("085#0000000000000007");
  check_last(window, 5, "0000000000000007");
  window.write(0, 0x3005, 5, 8, {}).check_failed(0x06010002);
  check_missing(window, 0x3005, 128, 0x06090011);
  window.read(0, 0x3005, 5, 7).check_failed(0x05040005);
  window.expect_silence();
}

TEST_CASE("[OBJ-20] 3005h: which frames are EMCY messages") {
  Window window;
  for (const char* frame :
       {"085#30811101020304", "085#", "085#R8", "00000085#3081110102030405", "105#3081110102030405"}) {
    INFO(frame);
    window.arrive(frame);
    check_last(window, 5, kNothing);
  }
  window.arrive("085#3081110102030405", "085#00000000000000");
  check_last(window, 5, "3081110102030405");
  check_stops(window, "053081110102030405");
}

TEST_CASE("[OBJ-21] 3005h of the own node") {
  Window window;
  start_own_node(window, {{0x1400, 0x27F, 255, {0xA1000110}}});
  window.arrive("27F#01").expect("0FF#1082110100000000");  // too short
  check_last(window, Window::kOwnNode, "1082110100000000");
  check_stops(window, "7F1082110100000000");
  window.arrive("27F#0102").expect("0FF#0000000000000000");
  check_last(window, Window::kOwnNode, kNothing);
  check_stops(window, "7F" + kNothing, kNoStop);
}

TEST_CASE("[OBJ-21] not that of another node with the same ID") {
  Window window;
  window.arrive("0FF#3081110102030405");
  check_last(window, Window::kOwnNode, kNothing);
  check_stops(window, kNoStop);
}

TEST_CASE("[OBJ-6] 3006h") {
  Window window;
  check_stops(window, kNoStop);
  window.arrive("085#3081110102030405");
  window.set(3706, filled_data());
  window.read(0, 0x3006, 0, 9);
  CHECK(window.target().read(3700, 12) ==
        Words{0, 5055, 0, 0x3006, 0, 9, 0x3005, 0x1181, 0x0201, 0x0403, 0x0005, 0xD000 + 3711});
  window.read(0, 0x3006, 0, 8).check_failed(0x05040005);
  window.write(0, 0x3006, 0, 9, {}).check_failed(0x06010002);
  check_missing(window, 0x3006, 1, 0x06090011);
}

TEST_CASE("[OBJ-22] 3006h: the order") {
  Window window;
  window.arrive("0FE#3081110102030405", "085#0010010000000000", "081#0020010000000000");
  for (int round = 0; round < 2; ++round)
    check_stops(window, "010020010000000000", "050010010000000000", "7E3081110102030405");
  check_stops(window, "010020010000000000");
  window.arrive("083#0030010000000000");  // before 5, where the scan would have continued
  check_stops(window, "030030010000000000");
  window.arrive("082#0040010000000000");  // before the current position: found in the next round
  check_stops(window, "050010010000000000", "7E3081110102030405", "010020010000000000", "020040010000000000");
}

TEST_CASE("[OBJ-23] 3006h: an error stops each round") {
  Window window;
  window.arrive("085#0010010000000000", "089#0050010000000000");
  for (int round = 0; round < 3; ++round)
    check_stops(window, "050010010000000000", "090050010000000000");
  window.arrive("089#0060050000000000");  // replaced by another message
  check_stops(window, "050010010000000000", "090060050000000000");
  window.arrive("085#0000000000000000");
  check_stops(window, "05" + kNothing);
  for (int round = 0; round < 3; ++round)
    check_stops(window, "090060050000000000");
}

TEST_CASE("[OBJ-24] 3006h: No Error stops once") {
  Window window;
  SECTION("an error that has been shown") {
    window.arrive("085#0010010000000000");
    check_stops(window, "050010010000000000");
    window.arrive("085#0000000102030405");
    check_stops(window, "05" + kNothing);
  }
  SECTION("an error that has not") {
    window.arrive("085#0010010000000000", "085#0000000000000000");
    check_stops(window, "05" + kNothing);
  }
  SECTION("there was none before") {
    window.arrive("085#0000000102030405");
  }
  SECTION("No Error is said again before anybody has looked") {
    window.arrive("085#0010010000000000", "085#0000000000000000", "085#0000000000000000");
    check_stops(window, "05" + kNothing);
  }
  SECTION("an error again, and over again") {
    for (int i = 0; i < 2; ++i) {
      window.arrive("085#0010010000000000", "085#0000000000000000");
      check_stops(window, "05" + kNothing, kNoStop);
    }
  }
  check_stops(window, kNoStop, kNoStop);
}

TEST_CASE("[OBJ-25] 3006h: nothing found") {
  Window window;
  check_stops(window, kNoStop, kNoStop);
  window.arrive("085#0010010000000000");
  check_stops(window, "050010010000000000");
  check_stops(window, "050010010000000000");  // the round ends with the node where it began
  window.arrive("085#0000000000000000");
  check_stops(window, "05" + kNothing, kNoStop);
  window.arrive("084#0010010000000000");
  check_stops(window, "040010010000000000");
}

TEST_CASE("[OBJ-26] 3006h: one scan for all") {
  Window window;
  window.arrive("085#0010010000000000", "089#0050010000000000", "08A#0000000000000000");
  check_stops(window, "050010010000000000");
  window.arrive("67F#4006300000000000").expect("5FF#4106300009000000");  // another node, by SDO
  window.arrive("67F#6000000000000000").expect("5FF#0009005001000000");
  window.arrive("67F#7000000000000000").expect("5FF#1B00000000000000");
  check_stops(window, "050010010000000000");
}

// ---- The own EMCY messages, 1003h, 1014h and 1015h

namespace {

/// RPDO 1 with two bytes on 27Fh, RPDO 2 with two on 37Fh, and the own node in Operational.
void start_with_rpdos(Window& window) {
  start_own_node(window, {{0x1400, 0x27F, 255, {0xA1000110}}, {0x1401, 0x37F, 255, {0xA1000210}}});
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
    window.arrive("27F#02").expect_silence();  // reported once
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
    window.pass(1s).expect_silence();  // the first has not been received yet
    window.arrive("27F#0102");
    window.pass_nearly(100ms).expect_silence();
    window.pass_rest().expect("0FF#5082110100000000");
    window.pass(1s).expect_silence();
    window.arrive("27F#0102").expect("0FF#0000000000000000");
  }
  SECTION("two errors: 0000h tells what is left") {
    start_with_rpdos(window);
    window.arrive("27F#01", "37F#010203").expect("0FF#1082110100000000", "0FF#2082110200000000");
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
    start_own_node(window, {{0x1800, 0x1FF, 1, {0xA5800110}}});
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
    check_locals(window, {{0x1003, 0, {std::min(k + 1, 8u), 1}}, {0x1003, 1, {0x00018210 + 0x10000 * k, 4}}});
  }
  for (std::uint16_t sub = 1; sub <= 8; ++sub)
    CHECK(read_local(window, 0x1003, sub) == Value{0x000A8210 - 0x10000u * sub, 4});
  check_missing(window, 0x1003, 9, 0x06090011);
  check_read_only(window, 0x1003, 8);
  window.write(0, 0x1003, 0, 1, {1}).check_failed(0x06090030);
  CHECK(read_local(window, 0x1003, 0) == Value{8, 1});
  check_kept(window, 0x1003, 0, {0, 1});
  window.arrive("201#01");
  window.expect(emcy[0]);
  check_locals(window, {{0x1003, 0, {1, 1}}, {0x1003, 1, {0x00018210, 4}}});
}

TEST_CASE("[OBJ-13] 1014h, 1015h") {
  Window window;
  check_locals(window, {{0x1014, 0, {0xFF, 4}}, {0x1015, 0, {0, 2}}});
  SECTION("another COB-ID: by way of invalid") {
    window.write(0, 0x1014, 0, 4, {0x3FF, 0}).check_failed(0x06090030);
    window.put(0x1014, 0, 0x800000FF);
    start_with_rpdos(window);
    window.arrive("27F#01", "27F#0102").expect_silence();
    window.put(0x1014, 0, 0x3FF);
    CHECK(read_local(window, 0x1014, 0) == Value{0x3FF, 4});
    window.arrive("27F#01").expect("3FF#1082110100000000");
  }
  SECTION("the inhibit time") {
    check_kept(window, 0x1015, 0, {5000, 2});
    start_with_rpdos(window);
    window.arrive("27F#01").expect("0FF#1082110100000000");
    window.arrive("37F#01020304");
    window.pass_nearly(500ms).expect_silence();
    window.pass_rest().expect("0FF#2082110200000000");
  }
}

// SPDX-License-Identifier: MIT
// docs/contract.md, "Local objects: R3702 = 0": EMCY messages of the nodes, 3005h and 3006h.

#include "contract/pdo.hpp"

using namespace cbcan::contract;

namespace {

const std::string kNothing = "0000000000000000";
const std::string kNoStop = "000000000000000000";

void check_last(Window& window, std::uint16_t node, const std::string& message) {
  CHECK(local_bytes(window, 0x3005, node) == message);
}

/// The next stop of the scan: node ID, then the message.
void check_stop(Window& window, const std::string& stop) {
  CHECK(local_bytes(window, 0x3006, 0) == stop);
}

}  // namespace

TEST_CASE("[OBJ-5] 3005h") {
  Window window;
  for (const std::uint16_t node : Words{1, 5, 126, 127})
    check_last(window, node, kNothing);
  window.arrive("085#3081110102030405");
  window.arrive("081#1042030000000000");
  window.arrive("0FE#FFFFFFFFFFFFFFFF");
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
  window.arrive("085#3081110102030405");
  window.arrive("085#00000000000000");
  check_last(window, 5, "3081110102030405");
  check_stop(window, "053081110102030405");
}

TEST_CASE("[OBJ-21] 3005h of the own node") {
  Window window;
  set_up_pdo(window, 0x1400, 0x27F, 255, {0xA1000110});
  start_own_node(window);
  window.arrive("27F#01").expect("0FF#1082110100000000");  // too short
  check_last(window, Window::kOwnNode, "1082110100000000");
  check_stop(window, "7F1082110100000000");
  window.arrive("27F#0102").expect("0FF#0000000000000000");
  check_last(window, Window::kOwnNode, kNothing);
  check_stop(window, "7F" + kNothing);
  check_stop(window, kNoStop);
}

TEST_CASE("[OBJ-21] not one of somebody else's with the same ID") {
  Window window;
  window.arrive("0FF#3081110102030405");
  check_last(window, Window::kOwnNode, kNothing);
  check_stop(window, kNoStop);
}

TEST_CASE("[OBJ-6] 3006h") {
  Window window;
  check_stop(window, kNoStop);
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
  window.arrive("0FE#3081110102030405");
  window.arrive("085#0010010000000000");
  window.arrive("081#0020010000000000");
  for (int round = 0; round < 2; ++round) {
    check_stop(window, "010020010000000000");
    check_stop(window, "050010010000000000");
    check_stop(window, "7E3081110102030405");
  }
  check_stop(window, "010020010000000000");
  window.arrive("083#0030010000000000");  // before 5, where it would have gone on
  check_stop(window, "030030010000000000");
  window.arrive("082#0040010000000000");  // behind it already: comes in the next round
  check_stop(window, "050010010000000000");
  check_stop(window, "7E3081110102030405");
  check_stop(window, "010020010000000000");
  check_stop(window, "020040010000000000");
}

TEST_CASE("[OBJ-23] 3006h: an error stops each round") {
  Window window;
  window.arrive("085#0010010000000000");
  window.arrive("089#0050010000000000");
  for (int round = 0; round < 3; ++round) {
    check_stop(window, "050010010000000000");
    check_stop(window, "090050010000000000");
  }
  window.arrive("089#0060050000000000");  // another one takes its place
  check_stop(window, "050010010000000000");
  check_stop(window, "090060050000000000");
  window.arrive("085#0000000000000000");
  check_stop(window, "05" + kNothing);
  for (int round = 0; round < 3; ++round)
    check_stop(window, "090060050000000000");
}

TEST_CASE("[OBJ-24] 3006h: No Error stops once") {
  Window window;
  SECTION("an error that has been shown") {
    window.arrive("085#0010010000000000");
    check_stop(window, "050010010000000000");
    window.arrive("085#0000000102030405");
    check_stop(window, "05" + kNothing);
  }
  SECTION("an error that has not") {
    window.arrive("085#0010010000000000");
    window.arrive("085#0000000000000000");
    check_stop(window, "05" + kNothing);
  }
  SECTION("there was none before") {
    window.arrive("085#0000000102030405");
  }
  SECTION("No Error is said again before anybody has looked") {
    window.arrive("085#0010010000000000");
    window.arrive("085#0000000000000000");
    window.arrive("085#0000000000000000");
    check_stop(window, "05" + kNothing);
  }
  SECTION("an error again, and over again") {
    for (int i = 0; i < 2; ++i) {
      window.arrive("085#0010010000000000");
      window.arrive("085#0000000000000000");
      check_stop(window, "05" + kNothing);
      check_stop(window, kNoStop);
    }
  }
  check_stop(window, kNoStop);
  check_stop(window, kNoStop);
}

TEST_CASE("[OBJ-25] 3006h: nothing found") {
  Window window;
  check_stop(window, kNoStop);
  check_stop(window, kNoStop);
  window.arrive("085#0010010000000000");
  check_stop(window, "050010010000000000");
  check_stop(window, "050010010000000000");  // the round ends with the node where it began
  window.arrive("085#0000000000000000");
  check_stop(window, "05" + kNothing);
  check_stop(window, kNoStop);
  window.arrive("084#0010010000000000");
  check_stop(window, "040010010000000000");
}

TEST_CASE("[OBJ-26] 3006h: one scan for all") {
  Window window;
  window.arrive("085#0010010000000000");
  window.arrive("089#0050010000000000");
  window.arrive("08A#0000000000000000");
  check_stop(window, "050010010000000000");
  window.arrive("67F#4006300000000000").expect("5FF#4106300009000000");  // another node, by SDO
  window.arrive("67F#6000000000000000").expect("5FF#0009005001000000");
  window.arrive("67F#7000000000000000").expect("5FF#1B00000000000000");
  check_stop(window, "050010010000000000");
}

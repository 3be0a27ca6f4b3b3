// SPDX-License-Identifier: MIT
// docs/contract.md, "Local objects: R3702 = 0".

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

/// A number, and how many bytes it has.
struct Value {
  std::uint32_t number;
  std::uint16_t size;
  bool operator==(const Value&) const = default;
};

std::ostream& operator<<(std::ostream& out, const Value& value) {
  return out << value.number << " in " << value.size << " bytes";
}

Value read_local(Window& window, std::uint16_t index, std::uint16_t sub) {
  window.set(3706, {0, 0});
  window.read(0, index, sub, 128);
  window.check_done();
  return {window.abort_code(), window.reg(3705)};
}

void check_read_only(Window& window, std::uint16_t index, std::uint16_t sub) {
  window.write(0, index, sub, 1, {1});
  window.check_failed(0x06010002);
}

}  // namespace

TEST_CASE("Local objects: R3702 = 0: 3001h:00 | U8 | ro | own node ID (CiA 405: GET_LOCAL_NODE_ID)") {
  Window window;
  CHECK(read_local(window, 0x3001, 0) == Value{127, 1});
  check_read_only(window, 0x3001, 0);
}

TEST_CASE(
    "Local objects: R3702 = 0: 3002h:00 | U8 | ro | kernel state: 00h none, 02h overflow, 10h bus off, 11h "
    "error passive (GET_CANOPEN_KERNEL_STATE)") {
  Window window;
  CHECK(read_local(window, 0x3002, 0) == Value{0x00, 1});
  check_read_only(window, 0x3002, 0);
  CONTRACT_NEEDS(window, Ability::kBusState);
  struct Row {
    BusState state;
    std::uint32_t shown;
  };
  for (const Row& row : {Row{BusState::kOverflow, 0x02}, Row{BusState::kBusOff, 0x10},
                         Row{BusState::kErrorPassive, 0x11}, Row{BusState::kActive, 0x00}}) {
    window.target().set_bus_state(row.state);
    CHECK(read_local(window, 0x3002, 0) == Value{row.shown, 1});
  }
}

TEST_CASE("Local objects: R3702 = 0: 3003h:00 | U16 | rw | SDO timeout in ms, 0 = none (TIMEOUT)") {
  Window window;
  CHECK(read_local(window, 0x3003, 0) == Value{1000, 2});
  window.configure(0x3003, 0, 2, {65535});
  CHECK(read_local(window, 0x3003, 0) == Value{65535, 2});
  SECTION("250 ms") {
    window.configure(0x3003, 0, 2, {250});
    window.read(5, 0x2000, 1, 4);
    window.expect("605#4000200100000000");
    window.pass_nearly(250ms);
    CHECK(window.busy());
    window.pass_rest();
    window.expect("605#8000200100000405");
    window.check_failed(0x05040000);
  }
  SECTION("none") {
    window.configure(0x3003, 0, 2, {0});
    window.read(5, 0x2000, 1, 4);
    window.expect("605#4000200100000000");
    window.pass(3600s);
    CHECK(window.busy());
    window.arrive("585#4300200111223344");
    window.check_done();
  }
}

TEST_CASE(
    "Local objects: R3702 = 0: 3004h:00 | U8 | rw | SDO transfer mode: 0 auto, 1 expedited, 2 segmented, 3 "
    "block (MODE)") {
  Window window;
  CHECK(read_local(window, 0x3004, 0) == Value{0, 1});
  struct Row {
    std::uint16_t mode;
    const char* request;
  };
  for (const Row& row : {Row{1, "605#2B00200111220000"}, Row{2, "605#2100200102000000"},
                         Row{3, "605#C600200102000000"}, Row{0, "605#2B00200111220000"}}) {
    window.configure(0x3004, 0, 1, {row.mode});
    CHECK(read_local(window, 0x3004, 0) == Value{row.mode, 1});
    window.write(5, 0x2000, 1, 2, {0x2211});
    window.exchange({{row.request, "585#8000200102000106"}});
    window.check_failed(0x06010002);
  }
  window.write(0, 0x3004, 0, 1, {4});
  window.check_failed(0x06090031);
  CHECK(read_local(window, 0x3004, 0) == Value{0, 1});
}

TEST_CASE(
    "Local objects: R3702 = 0: 3007h:n | U8 | ro | state of node n: 3 pre-operational, 4 stopped, 5 "
    "operational, 6 unknown, 7 not available (GET_STATE)") {
  Window window;
  CHECK(read_local(window, 0x3007, 127) == Value{3, 1});
  CHECK(read_local(window, 0x3007, 5) == Value{6, 1});
  window.configure(0x1016, 1, 4, {300, 5});
  CHECK(read_local(window, 0x3007, 5) == Value{7, 1});
  window.arrive("705#7F");
  CHECK(read_local(window, 0x3007, 5) == Value{3, 1});
  window.arrive("705#04");
  CHECK(read_local(window, 0x3007, 5) == Value{4, 1});
  window.arrive("705#05");
  CHECK(read_local(window, 0x3007, 5) == Value{5, 1});
  window.arrive("705#00");
  CHECK(read_local(window, 0x3007, 5) == Value{3, 1});
  check_read_only(window, 0x3007, 5);
  window.expect_silence();
}

TEST_CASE(
    "Local objects: R3702 = 0: 1016h:n | U32 | rw | consumer heartbeat time: node ID in bits 23..16, ms in "
    "bits 15..0; each node in one entry at most") {
  Window window;
  for (const std::uint16_t sub : Words{1, 7, 127}) {
    CHECK(read_local(window, 0x1016, sub) == Value{0, 4});
    window.configure(0x1016, sub, 4, {1500, 33});
    CHECK(read_local(window, 0x1016, sub) == Value{0x002105DC, 4});
    window.write(0, 0x1016, 8, 4, {1500, 33});
    window.check_failed(0x06040043);
    window.configure(0x1016, sub, 4, {2500, 33});  // in its own entry it may change
    CHECK(read_local(window, 0x1016, sub) == Value{0x002109C4, 4});
    window.configure(0x1016, sub, 4, {0, 33});
    CHECK(read_local(window, 0x1016, sub) == Value{0, 4});
  }
  window.write(0, 0x1016, 8, 4, {1500, 128});
  window.check_failed(0x06090030);
}

TEST_CASE(
    "Local objects: R3702 = 0: 1005h, 1006h | U32 | rw | SYNC producer: bit 30 of 1005h makes it one, 1006h "
    "is the period in microseconds") {
  Window window;
  CHECK(read_local(window, 0x1005, 0) == Value{0x80, 4});
  CHECK(read_local(window, 0x1006, 0) == Value{0, 4});
  window.configure(0x1006, 0, 4, {0xA120, 0x0007});  // 500,000 us
  CHECK(read_local(window, 0x1006, 0) == Value{500000, 4});
  window.pass(2s);
  window.expect_silence();
  window.configure(0x1005, 0, 4, {0x0080, 0x4000});
  CHECK(read_local(window, 0x1005, 0) == Value{0x40000080, 4});
  for (int i = 0; i < 3; ++i) {
    window.pass_nearly(500ms);
    window.expect_silence();
    window.pass_rest();
    window.expect("080#");
  }
  window.configure(0x1005, 0, 4, {0x0080, 0});
  window.pass(2s);
  window.expect_silence();
}

TEST_CASE("Local objects: R3702 = 0: 1017h:00 | U16 | rw | own heartbeat, ms") {
  Window window;
  CHECK(read_local(window, 0x1017, 0) == Value{0, 2});
  window.pass(3s);
  window.expect_silence();
  window.configure(0x1017, 0, 2, {500});
  CHECK(read_local(window, 0x1017, 0) == Value{500, 2});
  window.pass_nearly(500ms);
  window.expect_silence();
  window.pass_rest();
  window.expect("77F#7F");
  window.write(0, 0x1F82, 127, 1, {1});
  window.pass_nearly(500ms);
  window.expect_silence();
  window.pass_rest();
  window.expect("77F#05");
  window.configure(0x1017, 0, 2, {0});
  window.pass(3s);
  window.expect_silence();
}

TEST_CASE("Local objects: R3702 = 0: Besides 1000h, 1001h, 1008h, 1009h, 100Ah, 1018h and 1200h of CiA 301") {
  Window window;
  CHECK(read_local(window, 0x1000, 0) == Value{0, 4});
  CHECK(read_local(window, 0x1001, 0) == Value{0, 1});
  CHECK(read_local(window, 0x1018, 0) == Value{4, 1});
  for (const std::uint16_t sub : Words{1, 2, 3, 4})
    CHECK(read_local(window, 0x1018, sub).size == 4);
  CHECK(read_local(window, 0x1200, 0) == Value{2, 1});
  CHECK(read_local(window, 0x1200, 1) == Value{0x67F, 4});
  CHECK(read_local(window, 0x1200, 2) == Value{0x5FF, 4});
  CHECK(read_local(window, 0x1008, 0) == Value{0x61636263, 17});  // "cbca", of "cbcan coprocessor"
  for (const std::uint16_t text : Words{0x1009, 0x100A})
    CHECK(read_local(window, text, 0).size >= 3);
  window.read(0, 0x1003, 0, 4);
  window.check_failed(0x06020000);
}

TEST_CASE("Local objects: R3702 = 0: All of it is also reached by SDO from other nodes") {
  Window window;
  window.arrive("67F#4001300000000000");
  window.expect("5FF#4F0130007F000000");
  window.arrive("67F#4000100000000000");
  window.expect("5FF#4300100000000000");
  window.arrive("67F#2B033000FA000000");
  window.expect("5FF#6003300000000000");
  CHECK(read_local(window, 0x3003, 0) == Value{250, 2});
  window.arrive("67F#2F01300001000000");
  window.expect("5FF#8001300002000106");
  window.arrive("67F#4008100000000000");
  window.expect("5FF#4108100011000000");
  window.arrive("67F#6000000000000000");
  window.expect("5FF#00636263616E2063");  // "cbcan c"
  window.arrive("67F#7000000000000000");
  window.expect("5FF#106F70726F636573");  // "oproces"
  window.arrive("67F#6000000000000000");
  window.expect("5FF#09736F7200000000");  // "sor"
}

TEST_CASE(
    "Local objects: R3702 = 0: All of it is also reached by SDO from other nodes -- each object, and while "
    "the PLC reads somebody else") {
  Window window;
  window.read(5, 0x2000, 1, 4);
  window.expect("605#4000200100000000");
  struct Row {
    const char *request, *answer;
  };
  for (const Row& row : {Row{"67F#4001100000000000", "5FF#4F01100000000000"},
                         Row{"67F#4005100000000000", "5FF#4305100080000000"},
                         Row{"67F#4006100000000000", "5FF#4306100000000000"},
                         Row{"67F#4016100000000000", "5FF#4F1610007F000000"},
                         Row{"67F#4016100500000000", "5FF#4316100500000000"},
                         Row{"67F#4017100000000000", "5FF#4B17100000000000"},
                         Row{"67F#4018100000000000", "5FF#4F18100004000000"},
                         Row{"67F#4000120100000000", "5FF#430012017F060000"},
                         Row{"67F#4002300000000000", "5FF#4F02300000000000"},
                         Row{"67F#4003300000000000", "5FF#4B033000E8030000"},
                         Row{"67F#4004300000000000", "5FF#4F04300000000000"},
                         Row{"67F#4007300500000000", "5FF#4F07300506000000"}}) {
    window.arrive(row.request);
    window.expect(row.answer);
  }
  CHECK(window.busy());
  window.arrive("585#4300200111223344");
  window.check_done();
}

TEST_CASE(
    "Local objects: R3702 = 0: Reset node (1F82h on the own ID) puts all of it back to its settings, reset "
    "communication 1000h..1FFFh") {
  Window window;
  window.configure(0x3003, 0, 2, {250});
  window.configure(0x3004, 0, 1, {2});
  window.configure(0x1016, 1, 4, {300, 5});
  window.configure(0x1006, 0, 4, {0xA120, 0x0007});
  window.configure(0x1005, 0, 4, {0x0080, 0x4000});
  window.configure(0x1017, 0, 2, {500});
  SECTION("reset node") {
    window.write(0, 0x1F82, 127, 1, {129});
    window.check_done();
    window.expect("77F#00");
    CHECK(read_local(window, 0x3003, 0) == Value{1000, 2});
    CHECK(read_local(window, 0x3004, 0) == Value{0, 1});
  }
  SECTION("reset communication") {
    window.write(0, 0x1F82, 127, 1, {130});
    window.check_done();
    window.expect("77F#00");
    CHECK(read_local(window, 0x3003, 0) == Value{250, 2});
    CHECK(read_local(window, 0x3004, 0) == Value{2, 1});
  }
  CHECK(read_local(window, 0x1016, 1) == Value{0, 4});
  CHECK(read_local(window, 0x3007, 5) == Value{6, 1});
  CHECK(read_local(window, 0x1006, 0) == Value{0, 4});
  CHECK(read_local(window, 0x1005, 0) == Value{0x80, 4});
  CHECK(read_local(window, 0x1017, 0) == Value{0, 2});
  window.pass(3s);
  window.expect_silence();
}

TEST_CASE(
    "Local objects: R3702 = 0: 3007h: a node is unknown (6) while nothing recent has come from it and no "
    "consumer heartbeat time is set for it; not available (7) when one is set and the node is not heard "
    "within it") {
  Window window;
  SECTION("no consumer heartbeat time is set") {
    CHECK(read_local(window, 0x3007, 5) == Value{6, 1});
    window.arrive("705#05");
    window.pass_nearly(2s);
    CHECK(read_local(window, 0x3007, 5) == Value{5, 1});
    window.pass_rest();
    CHECK(read_local(window, 0x3007, 5) == Value{6, 1});
  }
  SECTION("one is set") {
    window.configure(0x1016, 1, 4, {300, 5});
    CHECK(read_local(window, 0x3007, 5) == Value{7, 1});
    window.arrive("705#05");
    window.pass_nearly(300ms);
    CHECK(read_local(window, 0x3007, 5) == Value{5, 1});
    window.pass_rest();
    CHECK(read_local(window, 0x3007, 5) == Value{7, 1});
    window.configure(0x1016, 1, 4, {0, 0});
    CHECK(read_local(window, 0x3007, 5) == Value{5, 1});  // within 2 s
  }
}

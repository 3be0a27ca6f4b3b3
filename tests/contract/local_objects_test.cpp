// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Local objects: R3702 = 0".

#include "contract/pdo.hpp"

using namespace cbcan::contract;

TEST_CASE("[OBJ-1] 3001h") {
  Window window;
  CHECK(read_local(window, 0x3001, 0) == Value{127, 1});
  check_read_only(window, 0x3001, 0);
}

TEST_CASE("[OBJ-2] 3002h") {
  Window window;
  CHECK(read_local(window, 0x3002, 0) == Value{0x00, 1});
  check_read_only(window, 0x3002, 0);
  CONTRACT_NEEDS(window, Ability::kBusState);
  struct Row {
    BusState state;
    std::uint32_t shown;
    const char* emcy;  ///< when bus-off has ended
  };
  for (const Row& row : {Row{BusState::kOverflow, 0x02, "0FF#1081110000000000"},
                         Row{BusState::kBusOff, 0x10, "0FF#4081110000000000"},
                         Row{BusState::kErrorPassive, 0x11, "0FF#2081110000000000"}}) {
    window.target().set_bus_state(row.state);
    CHECK(read_local(window, 0x3002, 0) == Value{row.shown, 1});
    window.target().set_bus_state(BusState::kActive);
    CHECK(read_local(window, 0x3002, 0) == Value{0x00, 1});
    window.expect(row.emcy);
    window.expect("0FF#0000000000000000");
  }
}

TEST_CASE("[OBJ-3] 3003h") {
  Window window;
  CHECK(read_local(window, 0x3003, 0) == Value{1000, 2});
  check_kept(window, 0x3003, 0, {65535, 2});
  SECTION("250 ms") {
    window.configure(0x3003, 0, 2, {250});
    window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
    window.pass_nearly(250ms);
    CHECK(window.busy());
    window.pass_rest().expect("605#8000200100000405");
    window.check_failed(0x05040000);
  }
  SECTION("none") {
    window.configure(0x3003, 0, 2, {0});
    window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
    window.pass(100s);  // the longest timeout is 65.535 s
    CHECK(window.busy());
    window.arrive("585#4300200111223344").check_done();
  }
}

TEST_CASE("[OBJ-4] 3004h") {
  Window window;
  CHECK(read_local(window, 0x3004, 0) == Value{0, 1});
  struct Row {
    std::uint16_t mode;
    const char* request;
  };
  for (const Row& row : {Row{1, "605#2B00200111220000"}, Row{2, "605#2100200102000000"},
                         Row{3, "605#C600200102000000"}, Row{0, "605#2B00200111220000"}}) {
    check_kept(window, 0x3004, 0, {row.mode, 1});
    window.write(5, 0x2000, 1, 2, {0x2211}).exchange({{row.request, "585#8000200102000106"}});
    window.check_failed(0x06010002);
  }
  window.write(0, 0x3004, 0, 1, {4}).check_failed(0x06090031);
  CHECK(read_local(window, 0x3004, 0) == Value{0, 1});
}

TEST_CASE("[OBJ-14] 1016h") {
  Window window;
  for (const std::uint16_t sub : Words{1, 7, 127}) {
    CHECK(read_local(window, 0x1016, sub) == Value{0, 4});
    check_kept(window, 0x1016, sub, {0x002105DC, 4});
    window.write(0, 0x1016, 8, 4, {1500, 33}).check_failed(0x06040043);
    check_kept(window, 0x1016, sub, {0x002109C4, 4});  // may change in its own entry
    window.configure(0x1016, sub, 4, {0, 33});
    CHECK(read_local(window, 0x1016, sub) == Value{0, 4});
  }
  window.configure(0x1016, 8, 4, {1500, 33});
  window.configure(0x1016, 8, 4, {1500, 128});  // unused
  CHECK(read_local(window, 0x1016, 8) == Value{0, 4});
}

TEST_CASE("[OBJ-10] 1005h, 1006h") {
  Window window;
  check_locals(window, {{0x1005, 0, {0x80, 4}}, {0x1006, 0, {0, 4}}});
  check_kept(window, 0x1006, 0, {500000, 4});
  window.pass(2s).expect_silence();
  check_kept(window, 0x1005, 0, {0x40000080, 4});
  for (int i = 0; i < 3; ++i) {
    window.pass_nearly(500ms).expect_silence();
    window.pass_rest().expect("080#");
  }
  window.write(0, 0x1005, 0, 4, {0x0081, 0x4000}).check_failed(0x06090030);  // not while it is produced
  window.configure(0x1006, 0, 4, {0, 0});
  window.write(0, 0x1005, 0, 4, {0x0081, 0x4000}).check_failed(0x06090030);  // nor without a period
  window.configure(0x1005, 0, 4, {0x0080, 0});
  window.pass(2s).expect_silence();
}

TEST_CASE("[OBJ-11] 1007h, 1019h") {
  Window window;
  check_locals(window, {{0x1007, 0, {0, 4}}, {0x1019, 0, {0, 1}}});
  SECTION("a synchronous PDO counts within the window") {
    check_kept(window, 0x1007, 0, {5000, 4});
    start_own_node(window, {{0x1400, 0x27F, 1, {0xA1000110}}});
    window.arrive("080#");
    window.pass_nearly(5ms);
    window.arrive("27F#0102");
    window.pass_rest();
    window.arrive("27F#0304", "080#");
    CHECK(window.reg(kInputs) == 0x0201);
  }
  SECTION("SYNC messages count") {
    check_kept(window, 0x1019, 0, {3, 1});
    window.put(0x1006, 0, 100000);
    window.put(0x1005, 0, 0x40000080);
    for (const char* frame : {"080#01", "080#02", "080#03", "080#01"}) {
      window.pass(100ms);
      window.expect(frame);
    }
    window.write(0, 0x1019, 0, 1, {4}).check_failed(0x08000022);
    window.put(0x1006, 0, 0);
    for (const std::uint16_t overflow : Words{1, 241})
      window.write(0, 0x1019, 0, 1, {overflow}).check_failed(0x06090030);
  }
}

TEST_CASE("[OBJ-8] 3008h") {
  Window window;
  CHECK(local_bytes(window, 0x3008, 0).size() == 12);
  window.configure(0x3008, 0, 6, {0x0304, 0x0102, 0x2A1B});
  window.expect_silence();
  CHECK(local_bytes(window, 0x3008, 0) == "040302011B2A");
  window.pass(1s);
  CHECK(local_bytes(window, 0x3008, 0) == "EC0602011B2A");  // 01020304h + 1000
  window.put(0x1012, 0, 0x40000100);
  window.configure(0x3008, 0, 6, {0x0304, 0x0102, 0x2A1B});
  window.expect("100#040302011B2A");
  SECTION("midnight") {
    window.configure(0x3008, 0, 6, {0x5BFF, 0x0526, 0x00FF});  // 86,399,999 ms
    window.expect("100#FF5B2605FF00");
    window.pass(1ms);
    CHECK(local_bytes(window, 0x3008, 0) == "000000000001");
  }
  SECTION("by SDO from another node") {
    window.arrive("67F#2108300006000000").expect("5FF#6008300000000000");
    window.arrive("67F#0301000000020000").expect("100#010000000200", "5FF#2000000000000000");
    CHECK(local_bytes(window, 0x3008, 0) == "010000000200");
  }
}

TEST_CASE("[OBJ-12] 1012h") {
  Window window;
  CHECK(read_local(window, 0x1012, 0) == Value{0x100, 4});
  window.configure(0x3008, 0, 6, {1, 0, 1});
  window.arrive("100#040302011B2A");
  CHECK(local_bytes(window, 0x3008, 0) == "010000000100");
  SECTION("a consumer") {
    window.put(0x1012, 0, 0x80000100);
    CHECK(read_local(window, 0x1012, 0) == Value{0x80000100, 4});
    window.write(0, 0x1012, 0, 4, {0x190, 0x8000}).check_failed(0x06090030);
    for (const char* frame : {"100#0403020102", "100#R6", "101#040302011B2A", "00000100#040302011B2A"}) {
      window.arrive(frame);
      CHECK(local_bytes(window, 0x3008, 0) == "010000000100");
    }
    window.arrive("100#040302F11B2A");  // the four highest bits are not part of the milliseconds
    CHECK(local_bytes(window, 0x3008, 0) == "040302011B2A");
    window.configure(0x3008, 0, 6, {1, 0, 1});
    window.expect_silence();
  }
  SECTION("a producer") {
    window.put(0x1012, 0, 0x40000100);
    CHECK(read_local(window, 0x1012, 0) == Value{0x40000100, 4});
    window.write(0, 0x1012, 0, 4, {0x190, 0x4000}).check_failed(0x06090030);  // not while it is in use
    window.arrive("100#040302011B2A");
    CHECK(local_bytes(window, 0x3008, 0) == "010000000100");
    window.configure(0x3008, 0, 6, {2, 0, 1});
    window.expect("100#020000000100");
    command_own_node(window, 2);
    window.configure(0x3008, 0, 6, {3, 0, 1});
    window.expect_silence();  // there is no TIME in Stopped (CiA 301, table 37)
  }
  SECTION("another COB-ID") {
    window.put(0x1012, 0, 0x190);
    window.put(0x1012, 0, 0xC0000190);
    window.arrive("190#040302011B2A");
    CHECK(local_bytes(window, 0x3008, 0) == "040302011B2A");
    window.configure(0x3008, 0, 6, {1, 0, 1});
    window.expect("190#010000000100");
    window.write(0, 0x1012, 0, 4, {0x605, 0}).check_failed(0x06090030);
  }
}

TEST_CASE("[OBJ-34] 1010h, 1011h, without a memory") {
  Window window;
  for (const std::uint16_t index : Words{0x1010, 0x1011}) {
    check_locals(window, {{index, 0, {4, 1}}, {index, 1, {0, 4}}});
    for (const std::uint16_t sub : Words{1, 2, 3, 4}) {
      window.write(0, index, sub, 4, {0x6173, 0x6576}).check_failed(0x08000020);
      window.write(0, index, sub, 4, {0x6F6C, 0x6461}).check_failed(0x08000020);
      window.write(0, index, sub, 4, {0, 0}).check_failed(0x08000020);
    }
    check_missing(window, index, 5, 0x06090011);
  }
}

TEST_CASE("[OBJ-35] a block download whose client is silent") {
  Window window;
  window.arrive("67F#C408300000000000").expect("5FF#A40830007F000000");
  window.pass_nearly(1s);
  window.arrive("67F#8101000000020000").expect("5FF#A2017F0000000000");  // the time begins again
  window.pass_nearly(1s).expect_silence();
  window.pass_rest().expect("5FF#8008300000000405");
  window.arrive("67F#4017100000000000").expect("5FF#4B17100000000000");
}

TEST_CASE("[OBJ-16] 1029h") {
  Window window;
  CHECK(read_local(window, 0x1029, 1) == Value{1, 1});
  CONTRACT_NEEDS(window, Ability::kBusState);
  struct Row {
    std::uint16_t set;
    std::uint32_t found, becomes;  ///< as 3007h shows it
  };
  for (const Row& row :
       {Row{1, 5, 5}, Row{0, 5, 3}, Row{2, 5, 4}, Row{2, 3, 4}, Row{0, 3, 3}, Row{0, 4, 4}}) {
    INFO("1029h:01 = " << row.set << ", found in " << row.found);
    check_kept(window, 0x1029, 1, {row.set, 1});
    command_own_node(window, row.found == 5 ? 1 : row.found == 4 ? 2 : 128);
    window.target().set_bus_state(BusState::kBusOff);
    CHECK(read_local(window, 0x3007, Window::kOwnNode) == Value{row.becomes, 1});
    window.target().set_bus_state(BusState::kActive);
    CHECK(read_local(window, 0x3007, Window::kOwnNode) == Value{row.becomes, 1});
    command_own_node(window, 128);
    window.exchange({{"0FF#4081110000000000", ""}, {"0FF#0000000000000000", ""}});
  }
}

TEST_CASE("[OBJ-15] 1017h") {
  Window window;
  CHECK(read_local(window, 0x1017, 0) == Value{0, 2});
  window.pass(3s).expect_silence();
  check_kept(window, 0x1017, 0, {500, 2});
  window.pass_nearly(500ms).expect_silence();
  window.pass_rest().expect("77F#7F");
  window.write(0, 0x1F82, 127, 1, {1});
  window.pass_nearly(500ms).expect_silence();
  window.pass_rest().expect("77F#05");
  window.configure(0x1017, 0, 2, {0});
  window.pass(3s).expect_silence();
}

TEST_CASE("[OBJ-17] the other objects of CiA 301") {
  Window window;
  check_locals(window, {{0x1000, 0, {405, 4}}, {0x1001, 0, {0, 1}}, {0x1018, 0, {4, 1}}});
  for (const std::uint16_t sub : Words{1, 2, 3, 4})
    CHECK(read_local(window, 0x1018, sub).size == 4);
  check_locals(window, {{0x1200, 0, {2, 1}}, {0x1200, 1, {0x67F, 4}}, {0x1200, 2, {0x5FF, 4}}});
  CHECK(read_local(window, 0x1008, 0) == Value{0x61636263, 17});  // "cbca", of "cbcan coprocessor"
  for (const std::uint16_t text : Words{0x1009, 0x100A})
    CHECK(read_local(window, text, 0).size >= 3);
  check_missing(window, 0x1002, 0, 0x06020000);
}

TEST_CASE("[OBJ-18] by SDO from other nodes") {
  Window window;
  window.arrive("67F#4001300000000000").expect("5FF#4F0130007F000000");
  window.arrive("67F#4000100000000000").expect("5FF#4300100095010000");
  window.arrive("67F#2B033000FA000000").expect("5FF#6003300000000000");
  CHECK(read_local(window, 0x3003, 0) == Value{250, 2});
  window.arrive("67F#2F01300001000000").expect("5FF#8001300002000106");
  window.arrive("67F#4008100000000000").expect("5FF#4108100011000000");
  window.arrive("67F#6000000000000000").expect("5FF#00636263616E2063");  // "cbcan c"
  window.arrive("67F#7000000000000000").expect("5FF#106F70726F636573");  // "oproces"
  window.arrive("67F#6000000000000000").expect("5FF#09736F7200000000");  // "sor"
}

TEST_CASE("[OBJ-19] resets") {
  Window window;
  const Local changed[] = {{0x3003, 0, {250, 2}},  {0x3004, 0, {2, 1}},          {0x1016, 1, {0x0005012C, 4}},
                           {0x1019, 0, {10, 1}},   {0x1006, 0, {500000, 4}},     {0x1005, 0, {0x40000080, 4}},
                           {0x1007, 0, {1000, 4}}, {0x1012, 0, {0x40000100, 4}}, {0x1014, 0, {0x800000FF, 4}},
                           {0x1015, 0, {10, 2}},   {0x1017, 0, {500, 2}},        {0x1029, 1, {2, 1}}};
  for (const auto& [index, sub, value] : changed)
    check_kept(window, index, sub, value);
  set_up_pdo(window, 0x140F, 0x27F, 1, {0xA1000110});
  set_up_pdo(window, 0x180F, 0x1FF, 1, {0xA5800110});
  window.arrive("085#3081110102030405");
  SECTION("reset node") {
    window.command(127, 129, "77F#00");
    check_locals(window, {{0x3003, 0, {1000, 2}}, {0x3004, 0, {0, 1}}});
    CHECK(local_bytes(window, 0x3005, 5) == "0000000000000000");
    CHECK(local_bytes(window, 0x3006, 0) == "000000000000000000");
  }
  SECTION("reset communication") {
    window.command(127, 130, "77F#00");
    check_locals(window, {{0x3003, 0, {250, 2}}, {0x3004, 0, {2, 1}}});
    CHECK(local_bytes(window, 0x3005, 5) == "3081110102030405");
  }
  check_locals(window, {{0x1016, 1, {0, 4}}, {0x3007, 5, {6, 1}}, {0x1006, 0, {0, 4}}});
  check_locals(window, {{0x1005, 0, {0x80, 4}}, {0x1007, 0, {0, 4}}, {0x1012, 0, {0x100, 4}}});
  check_locals(window, {{0x1014, 0, {0xFF, 4}}, {0x1015, 0, {0, 2}}, {0x1017, 0, {0, 2}}});
  check_locals(window, {{0x1019, 0, {0, 1}}, {0x1029, 1, {1, 1}}});
  for (const std::uint16_t pdo : Words{0x140F, 0x180F}) {
    CHECK((read_local(window, pdo, 1).number & 0x80000000) != 0);
    CHECK(read_local(window, pdo, 2) == Value{255, 1});
    CHECK(read_local(window, static_cast<std::uint16_t>(pdo + 0x200), 0) == Value{0, 1});
  }
  window.pass(3s).expect_silence();
}

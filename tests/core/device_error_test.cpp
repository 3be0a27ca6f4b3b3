// SPDX-License-Identifier: MIT
// What a whole CANopen device does about errors, as its master sees it on the wire: EMCY, heartbeat consumer,
// life guarding, bus-off.

#include "core/device_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;
using enum cbcan::DataType;

// ---- EMCY

TEST_CASE("EMCY: once for each error and once for its end; 1001h and 1003h follow") {
  StartedRig rig;
  auto& emergency = rig.device.emergency();
  emergency.error(0x2310, 0x02, {0x11, 0x22, 0x33, 0x44, 0x55}, rig.now);
  rig.expect("0C2#1023031122334455");
  emergency.error(0x2310, 0x02, {}, rig.now);
  rig.expect_silence();
  emergency.error(0x4210, 0x08, {}, rig.now);
  rig.expect("0C2#10420B0000000000");
  rig.reads({{0x1001, 0, 0x0B}, {0x1003, 0, 2}, {0x1003, 1, 0x00004210}, {0x1003, 2, 0x22112310}});
  emergency.error_over(0x2310, rig.now);
  rig.expect("0C2#0000090000000000");
  emergency.error_over(0x2310, rig.now);
  rig.expect_silence();
  emergency.error_over(0x4210, rig.now);
  rig.expect("0C2#0000000000000000");
  rig.reads({{0x1001, 0, 0}, {0x1003, 0, 2}});
}

TEST_CASE("1003h: the newest first, the oldest out, and 0 written to sub-index 0 empties it") {
  StartedRig rig;
  for (std::uint16_t code = 0x1001; code <= 0x1004; ++code)
    rig.device.emergency().error(code, 0, {}, rig.now);
  rig.port.sent.clear();
  rig.reads({{0x1003, 0, 3}, {0x1003, 1, 0x1004}, {0x1003, 3, 0x1002}});
  rig.write({{0x1003, 0, 1, 1, "06090030"}, {0x1003, 0, 1, 0}});
  rig.reads({{0x1003, 1, 0}, {0x1003, 3, 0}});
}

TEST_CASE("1003h with an entry for each sub-index, as in EDS files, keeps as many errors; it begins empty") {
  DeviceRig rig({{0x1003, 0, 0, kUnsigned8, 2},  // as some files say
                 {0x1003, 1, 1, kUnsigned32, 0x1234},
                 {0x1003, 2, 2, kUnsigned32},
                 {0x1003, 3, 3, kUnsigned32},
                 {0x2001, 0, 0, kUnsigned8}});
  rig.start();
  rig.reads({{0x1003, 0, 0}, {0x1003, 1, 0}});
  for (std::uint16_t code = 0x1001; code <= 0x1002; ++code)
    rig.device.emergency().error(code, 0, {}, rig.now);
  rig.reads({{0x1003, 0, 2}, {0x1003, 1, 0x1002}, {0x1003, 2, 0x1001}});
  for (std::uint16_t code = 0x1003; code <= 0x1004; ++code)
    rig.device.emergency().error(code, 0, {}, rig.now);
  rig.reads({{0x1003, 0, 3}, {0x1003, 3, 0x1002}});
  rig.write(0x1003, 0, 1, 0);
  CHECK(rig.read(0x1003, 3) == 0);
  rig.arrive("000#8242").expect("742#00");
  CHECK(rig.read(0x1003, 0) == 0);
}

TEST_CASE("1003h with 255 entries: 254 errors, and the loops end") {
  DeviceRig rig({{0x1003, 0, 0, kUnsigned8}, {0x1003, 1, 0xFF, kUnsigned32}});
  rig.start();
  for (std::uint16_t code = 0x1001; code <= 0x1100; ++code) {
    rig.device.emergency().error(code, 0, {}, rig.now);
    rig.device.emergency().error_over(code, rig.now);
  }
  rig.reads({{0x1003, 0, 0xFE}, {0x1003, 1, 0x1100}, {0x1003, 0xFE, 0x1003}, {0x1003, 0xFF, 0}});
}

TEST_CASE("More errors and messages than there is room for are counted, and those before them are not lost") {
  StartedRig rig;
  auto& emergency = rig.device.emergency();
  rig.arrive("000#0200");
  for (std::uint16_t code = 0x1001; code <= 0x1011; ++code)
    emergency.error(code, 0, {}, rig.now);
  CHECK(emergency.counters().lost == 1);
  CHECK_FALSE(emergency.has(0x1011));
  emergency.error_over(0x1001, rig.now);  // its message finds no room either
  CHECK(emergency.counters().lost == 2);
  CHECK_FALSE(emergency.has(0x1001));
  rig.arrive("000#8000");
  CHECK(rig.port.sent.size() == 16);
  rig.expect("0C2#0110010000000000");
  CHECK(rig.port.sent.back() == "0C2#1010010000000000");
  rig.port.sent.clear();
}

TEST_CASE("EMCY that the port refuses is tried again") {
  StartedRig rig;
  rig.port.refuse_next = 3;
  rig.device.emergency().error(0x1000, 0, {}, rig.now);
  rig.pass(299).expect_silence();
  rig.pass(1).expect("0C2#0010010000000000");
}

TEST_CASE("Errors outlive a reset of the communication in 1001h, and end with a reset of the node") {
  StartedRig rig;
  rig.device.emergency().error(0x2310, 0x02, {}, rig.now);
  rig.expect("0C2#1023030000000000");
  rig.arrive("000#8242").expect("742#00");
  CHECK(rig.read(0x1001, 0) == 0x03);
  rig.arrive("000#8142").expect("742#00");
  rig.reads({{0x1001, 0, 0}, {0x1003, 0, 0}});
}

// ---- Heartbeat consumer, life guarding

TEST_CASE("1016h: a node that was heard and falls silent is EMCY 8130h, once; heard again it is over") {
  StartedRig rig(true);
  rig.write(0x1016, 1, 4, 0x00050064);
  CHECK(rig.received_ids() == std::vector<std::uint32_t>{0x000, 0x080, 0x642, 0x705, 0x742});
  rig.pass(kSecond).expect_silence();  // never heard is not lost
  rig.events.clear();
  rig.arrive("705#05");
  rig.pass(99 * kMillisecond);
  rig.arrive("705#05");
  rig.pass(100 * kMillisecond - 1).expect_silence();
  rig.pass(1).expect("0C2#3081110000000000");
  CHECK(rig.events == std::vector<std::string>{"lost heartbeat", "state 127"});  // 1029h:01 = 0
  rig.pass(kSecond).expect_silence();
  rig.arrive("705#05").expect("0C2#0000000000000000");
}

TEST_CASE("1016h: a node once; entries without a node or without a time are unused, whatever else they say") {
  StartedRig rig(true);
  rig.write({{0x1016, 1, 4, 0x00050064},
             {0x1016, 2, 4, 0x000503E8, "06040043"},
             {0x1016, 1, 4, 0x000503E8},
             {0x1016, 2, 4, 0x00050000},
             {0x1016, 3, 4, 0x00000064},
             {0x1016, 3, 4, 0x00800064, "06090030"},
             {0x1016, 3, 4, 0x007F0064}});
  CHECK(rig.received_ids() == std::vector<std::uint32_t>{0x000, 0x080, 0x642, 0x705, 0x742, 0x77F});
}

TEST_CASE("1016h: what is no heartbeat of a watched node keeps nobody alive") {
  StartedRig rig(true);
  rig.write(0x1016, 1, 4, 0x00050064);
  rig.arrive("705#05");
  rig.pass(99 * kMillisecond);
  rig.arrive("705#", "705#R1", "706#05", "00000705#05", "700#05", "685#05");
  rig.pass(kMillisecond).expect("0C2#3081110000000000");
  rig.arrive("705#").expect_silence();
}

TEST_CASE("1029h:01 = 2 stops the node in Pre-operational too, 0 and 1 leave it there") {
  for (const std::uint32_t reaction : {0u, 1u, 2u}) {
    INFO(reaction);
    StartedRig rig;
    rig.write(0x1029, 1, 1, reaction);
    rig.events.clear();
    rig.device.on_bus_state(BusState::kBusOff, rig.now);
    CHECK(rig.device.state() ==
          (reaction == 2 ? cbcan::nmt::State::kStopped : cbcan::nmt::State::kPreOperational));
    CHECK(rig.events.size() == (reaction == 2 ? 2u : 1u));  // a state is not entered anew
    rig.events.clear();
  }
}

TEST_CASE("1029h:01 = 1 leaves the state alone, 2 stops the node") {
  for (const auto& [reaction, events] : std::map<std::uint32_t, std::vector<std::string>>{
           {1, {"lost heartbeat"}}, {2, {"lost heartbeat", "state 4"}}}) {
    StartedRig rig(true);
    rig.write({{0x1029, 1, 1, reaction}, {0x1016, 2, 4, 0x00050064}});
    rig.events.clear();
    rig.arrive("705#05");
    rig.pass(100 * kMillisecond);
    CHECK(rig.events == events);
    rig.expect("0C2#3081110000000000");
  }
}

TEST_CASE("Two watched nodes lost are one error, over when both are back") {
  StartedRig rig;
  rig.write({{0x1016, 1, 4, 0x00050064}, {0x1016, 2, 4, 0x00060032}});
  rig.arrive("705#05", "706#05");
  rig.pass(50 * kMillisecond).expect("0C2#3081110000000000");
  rig.pass(50 * kMillisecond).expect_silence();
  rig.arrive("706#05").expect_silence();
  rig.arrive("705#00").expect("0C2#0000000000000000");
}

TEST_CASE("Node guarding: the toggle bit alternates; life guarding watches the master") {
  StartedRig rig(true);
  rig.write({{0x100C, 0, 2, 100}, {0x100D, 0, 1, 3}});
  rig.pass(kSecond).expect_silence();  // it begins with the first request
  rig.arrive("742#R1").expect("742#05");
  rig.pass(299 * kMillisecond);
  rig.arrive("742#R1").expect("742#85");
  rig.events.clear();
  rig.pass(300 * kMillisecond).expect("0C2#3081110000000000");
  CHECK(rig.events == std::vector<std::string>{"lost guarding", "state 127"});
  rig.arrive("742#R1").expect("742#7F", "0C2#0000000000000000");
}

TEST_CASE("Bus-off is a network failure too; back on the bus it is told, by EMCY 8140h") {
  StartedRig rig(true);
  rig.device.on_bus_state(BusState::kBusOff, rig.now);
  rig.device.on_bus_state(BusState::kBusOff, rig.now);
  CHECK(rig.events == std::vector<std::string>{"lost bus-off", "state 127"});
  rig.expect_silence();
  rig.device.on_bus_state(BusState::kActive, rig.now);
  rig.expect("0C2#4081110000000000", "0C2#0000000000000000");
}

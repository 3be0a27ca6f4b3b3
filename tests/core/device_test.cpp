// SPDX-License-Identifier: MIT
// A whole CANopen device, as its master sees it on the wire: SYNC, TIME, stored parameters. PDOs, and
// what it does about errors, have tests of their own.

#include "core/device_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;
using enum cbcan::DataType;

// ---- SYNC

TEST_CASE("A SYNC that the node itself produces is also its own") {
  StartedRig rig(true);
  rig.write({{0x1006, 0, 4, 10000}, {0x1005, 0, 4, 0x40000080}});
  rig.events.clear();
  rig.pass(10 * kMillisecond).expect("080#");
  CHECK(rig.events == std::vector<std::string>{"sync"});
}

TEST_CASE("SYNC acts in Operational, on the identifier in 1005h, data frames alone") {
  StartedRig rig;
  rig.write(0x1005, 0, 4, 0x85);
  rig.events.clear();
  rig.arrive("085#", "000#0142", "080#", "085#R0", "085#", "085#", "000#0242", "085#");
  CHECK(rig.events == std::vector<std::string>{"state 5", "sync", "sync", "state 4"});
  CHECK(rig.received_ids() == std::vector<std::uint32_t>{0x000, 0x085, 0x642, 0x742});
}

TEST_CASE("A SYNC of a length that 1019h does not say counts, and is EMCY 8240h until one is right") {
  StartedRig rig(true);
  rig.arrive("080#").expect_silence();
  rig.arrive("080#01").expect("0C2#4082110000000000");
  rig.arrive("080#0102").expect_silence();
  CHECK(rig.events == std::vector<std::string>{"sync", "sync", "sync"});
  rig.arrive("080#").expect("0C2#0000000000000000");
  rig.write(0x1019, 0, 1, 10);
  rig.arrive("080#").expect("0C2#4082110000000000");
  rig.arrive("000#8142").expect("742#00");
  rig.arrive("080#01").expect("0C2#4082110000000000");  // 1019h is 0 again; the error has been forgotten
}

TEST_CASE("Without 1005h there is no SYNC, and NMT commands are NMT commands") {
  DeviceRig rig({{0x1001, 0, 0, kUnsigned8}});
  rig.start();
  rig.arrive("000#0100");
  CHECK(rig.events == std::vector<std::string>{"state 5"});
}

// ---- NMT table

TEST_CASE("Stopped: no SDO, no SYNC, no TIME, no EMCY; error control alone") {
  StartedRig rig;
  rig.write({{0x1017, 0, 2, 1000}, {0x1012, 0, 4, 0x80000100}});
  rig.arrive("000#0200");
  rig.events.clear();
  rig.arrive("642#4001100000000000", "080#", "100#0000000001000000");
  rig.device.emergency().error(0x1000, 0, {}, rig.now);
  rig.pass(kSecond).expect("742#04");
  CHECK(rig.events.empty());
  rig.arrive("000#8000").expect("0C2#0010010000000000");  // it had waited
}

// ---- TIME

TEST_CASE("Error passive is EMCY 8120h, overflow 8110h, until the controller is well again") {
  StartedRig rig;
  rig.device.on_bus_state(BusState::kErrorPassive, rig.now);
  rig.expect("0C2#2081110000000000");
  rig.device.on_bus_state(BusState::kErrorPassive, rig.now);
  rig.expect_silence();
  rig.device.on_bus_state(BusState::kActive, rig.now);
  rig.expect("0C2#0000000000000000");
  rig.device.on_bus_state(BusState::kOverflow, rig.now);
  rig.expect("0C2#1081110000000000");
  rig.device.on_bus_state(BusState::kErrorPassive, rig.now);
  rig.expect("0C2#2081110000000000", "0C2#0000110000000000");
  rig.device.on_bus_state(BusState::kBusOff, rig.now);
  rig.expect_silence();
  rig.device.on_bus_state(BusState::kActive, rig.now);
  rig.expect("0C2#4081110000000000", "0C2#0000110000000000", "0C2#0000000000000000");
}

TEST_CASE("TIME consumer: milliseconds after midnight and days since 1984") {
  StartedRig rig;
  rig.arrive("100#0000000001000000");
  CHECK(rig.device.time_stamp().at(rig.now) == cbcan::TimeOfDay{0, 0});
  rig.write(0x1012, 0, 4, 0x80000100);
  CHECK(rig.received_ids() == std::vector<std::uint32_t>{0x000, 0x080, 0x100, 0x642, 0x742});
  rig.arrive("100#FF5B2605D03C");  // 86,400,000 - 1 ms after midnight, 15568 days: 2026-08-16
  CHECK(rig.device.time_stamp().at(rig.now) == cbcan::TimeOfDay{86'399'999, 15568});
  rig.pass(kMillisecond);
  CHECK(rig.device.time_stamp().at(rig.now) == cbcan::TimeOfDay{0, 15569});
  rig.now += 366 * 24 * 3600 * kSecond + 7 * 3600 * kSecond + 1'999;
  CHECK(rig.device.time_stamp().at(rig.now) == cbcan::TimeOfDay{25'200'001, 15935});
}

TEST_CASE("TIME consumer: what 1012h says at power-on, and again after a reset, holds without a write") {
  std::vector<cbcan::test::Row> rows = everything();
  for (cbcan::test::Row& row : rows)
    if (row.index == 0x1012) row.value = 0x80000200;
  DeviceRig rig(rows);
  rig.start();
  CHECK(rig.received_ids() == std::vector<std::uint32_t>{0x000, 0x080, 0x200, 0x642, 0x742});
  rig.arrive("200#E80300000200");
  CHECK(rig.device.time_stamp().at(rig.now) == cbcan::TimeOfDay{1000, 2});
  rig.write(0x1012, 0, 4, 0x200);
  rig.arrive("200#D00700000200");
  CHECK(rig.device.time_stamp().at(rig.now) == cbcan::TimeOfDay{1000, 2});
  rig.arrive("000#8142").expect("742#00");
  rig.arrive("200#D00700000200");
  CHECK(rig.device.time_stamp().at(rig.now) == cbcan::TimeOfDay{2000, 2});
}

TEST_CASE("The application hears of CAN-IDs that may have changed: after a reset, and after a write") {
  StartedRig rig;
  CHECK(rig.id_changes == 1);
  rig.write(0x1005, 0, 4, 0x81);
  CHECK(rig.id_changes == 2);
  rig.arrive("000#8142").expect("742#00");
  CHECK(rig.id_changes == 3);
}

TEST_CASE("A frame that is nobody's brings no deadline nearer, whatever else is due; one for the node may") {
  StartedRig rig;
  rig.write(0x1017, 0, 2, 100);
  CHECK_FALSE(rig.device.on_frame(frame_from("123#00"), rig.now));
  CHECK(rig.device.on_frame(frame_from("000#0142"), rig.now));
  CHECK_FALSE(rig.device.on_frame(frame_from("080#"), rig.now));
  rig.port.refuse_next = 1;
  CHECK(rig.device.on_frame(frame_from("080#01"), rig.now));  // its EMCY waits
}

TEST_CASE("Of SDO requests a download brings a deadline nearer, and a response that is refused") {
  StartedRig rig;
  const Frame upload = frame_from("642#4017100000000000");
  CHECK_FALSE(rig.device.on_frame(upload, rig.now));
  CHECK(rig.device.on_frame(frame_from("642#2B17100064000000"), rig.now));
  CHECK(rig.device.deadline() == rig.now + 100'000);
  rig.port.refuse_next = 1;
  CHECK(rig.device.on_frame(upload, rig.now));
  CHECK(rig.device.deadline() == rig.now + 100);
  rig.port.sent.clear();
}

TEST_CASE("A SYNC that has not come had no counter") {
  DeviceRig rig(everything());
  CHECK(cbcan::Sync(rig.device.dictionary(), rig.port).counter() == 0);
}

TEST_CASE("TIME producer: the time of day in its period") {
  StartedRig rig;
  rig.device.time_stamp().set({1000, 2}, rig.now);
  rig.device.time_stamp().produce_every(kSecond, rig.now);
  rig.pass(2 * kSecond).expect_silence();
  rig.write(0x1012, 0, 4, 0x40000100);
  rig.pass(kSecond).expect("100#A00F00000200");  // 4000 ms
  rig.write({{0x1012, 0, 4, 0x40000101, "06090030"}, {0x1012, 0, 4, 0x100}});
  rig.pass(2 * kSecond);
}

// ---- Parameters

TEST_CASE("1010h and 1011h: each sub-index its range, for the right signature") {
  StartedRig rig;
  rig.events.clear();
  rig.write({{0x1010, 1, 4, 0x64616F6C, "08000020"}, {0x1011, 1, 4, 0x65766173, "08000020"}});
  CHECK(rig.events == std::vector<std::string>{"refresh", "refresh"});
  rig.events.clear();
  rig.write({{0x1010, 1, 4, 0x65766173},
             {0x1010, 2, 4, 0x65766173},
             {0x1010, 3, 4, 0x65766173},
             {0x1011, 4, 4, 0x64616F6C}});
  std::vector<std::string> kept;
  for (const std::string& event : rig.events)
    if (event.find("..") != std::string::npos) kept.push_back(event);
  CHECK(kept == std::vector<std::string>{"save 1000..FFFF", "save 1000..1FFF", "save 6000..9FFF",
                                         "forget 2000..5FFF"});
  rig.keeps = AbortCode::kHardware;
  rig.write(0x1010, 1, 4, 0x65766173, "06060000");
}

TEST_CASE("1010h and 1011h: a device without a memory refuses") {
  DeviceRig rig(everything());
  rig.has_memory = false;
  rig.start();
  rig.write({{0x1010, 1, 4, 0x65766173, "08000020"}, {0x1011, 1, 4, 0x64616F6C, "08000020"}});
}

TEST_CASE("What the application refuses is not stored, and it hears of what is") {
  StartedRig rig;
  rig.events.clear();
  rig.write(0x2001, 0, 1, 0xEE, "06090030");
  CHECK(rig.events == std::vector<std::string>{"refresh"});
  rig.write(0x2001, 0, 1, 0x12);
  CHECK(rig.events == std::vector<std::string>{"refresh", "refresh", "written"});
  CHECK(rig.get(0x2001, 0) == 0x12);
}

TEST_CASE("A node ID that is set holds from the next reset of the communication on") {
  StartedRig rig;
  rig.device.set_node_id(0x43);
  CHECK(rig.read(0x1001, 0) == 0);
  rig.arrive("000#8242").expect("743#00");
  CHECK(rig.received_ids() == std::vector<std::uint32_t>{0x000, 0x080, 0x643, 0x743});
}

// ---- The edges of the numbers

TEST_CASE("FFFFh and sub-index FFh, the last there are, are like all others") {
  DeviceRig rig({{0x1016, 1, 0xFF, kUnsigned32},
                 {0x2001, 0xFF, 0xFF, kUnsigned8, 9},
                 {0xFFFF, 0, 0xFF, kUnsigned16, 7}});
  rig.start();
  CHECK(rig.read(0x2001, 0xFF) == 9);
  CHECK(rig.read(0xFFFF, 0xFF) == 7);
  rig.write(0xFFFF, 0xFF, 2, 8);
  rig.arrive("000#8142").expect("742#00");
  CHECK(rig.read(0xFFFF, 0) == 7);
}

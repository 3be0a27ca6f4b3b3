// SPDX-License-Identifier: MIT
// A whole CANopen device as seen by its master: what the tests of the contract and of simulated nodes do not
// cover. PDOs have their own tests.

#include "core/device_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

/// An application that overrides nothing but restore(): 2001h is always 7 after power-on; 2002h is not
/// computed, and 1010h stores nothing.
template <class Interface>
struct PlainApplication final : Wire, Interface {
  void restore(std::uint16_t, std::uint16_t, Time) override {
    std::ranges::copy(values_of(rows), values.begin());
  }

  const std::vector<ObjectRow> rows{
      {0x1010, 1, 1, kUnsigned32, 1},
      {0x2001, 0, 0, kUnsigned8, 7},
      {0x2002, 0, 0, kUnsigned8, 0, ObjectFlags::kRead | ObjectFlags::kComputed}};
  std::vector<ObjectEntry> entries = entries_of(rows, ObjectFlags::kChecked);
  std::vector<std::uint8_t> values = values_of(rows);
  std::vector<std::uint8_t> buffer = std::vector<std::uint8_t>(8);
};

}  // namespace

// ---- SYNC

TEST_CASE("A SYNC that the node itself produces is also its own") {
  DeviceRig rig;
  rig.start(true);
  rig.write({{0x1006, 0, 4, 10000}, {0x1005, 0, 4, 0x40000080}});
  rig.events.clear();
  rig.pass(10 * kMillisecond).expect("080#");
  CHECK(rig.events == std::vector<std::string>{"sync"});
}

TEST_CASE("A SYNC without a counter contains nothing of one with a counter") {
  struct Keeper final : CanPort {
    bool try_send(const Frame& frame) override {
      last = frame;
      return true;
    }
    Frame last;
  } port;
  const std::vector<ObjectRow> rows{{0x1005, 0, 0, kUnsigned32, 0x40000080},
                                    {0x1006, 0, 0, kUnsigned32, 1000},
                                    {0x1019, 0, 0, kUnsigned8, 2}};
  const std::vector<ObjectEntry> entries = entries_of(rows, ObjectFlags::kChecked);
  std::vector<std::uint8_t> values = values_of(rows);
  ObjectDictionary dictionary({entries, values}, nullptr);
  Sync sync(dictionary, port);
  sync.reset(1, 0);
  sync.on_state(nmt::State::kOperational, 0);
  sync.poll(1000);
  CHECK(port.last == Frame{0x80, 1, 0, {1}});
  dictionary.set(0x1019, 0, 0);
  sync.configure(0x1019, 1000);
  sync.poll(2000);
  CHECK(port.last == Frame{0x80, 0, 0, {}});
}

TEST_CASE("Without 1005h SYNC has CAN-ID 80h, and NMT commands are NMT commands") {
  DeviceRig rig({{0x1001, 0, 0, kUnsigned8}});
  rig.start();
  rig.arrive("000#0100");
  CHECK(rig.events == std::vector<std::string>{"state 5"});
  rig.arrive("080#");
  CHECK(rig.events == std::vector<std::string>{"state 5", "sync"});
}

// ---- SDO

TEST_CASE("The application hears once of what has been written") {
  DeviceRig rig;
  rig.start(true);
  rig.write(0x2001, 0, 1, 0x12);
  CHECK(rig.read(0x2001, 0) == 0x12);
  rig.arrive("080#");
  CHECK(rig.events == std::vector<std::string>{"written", "sync"});
}

TEST_CASE("Stopped ends an SDO transfer, and a response that has not left") {
  DeviceRig rig;
  rig.start();
  rig.arrive("642#2101200001000000").expect("5C2#6001200000000000");
  rig.arrive("000#0242", "000#8042", "642#0D11000000000000").expect("5C2#8001200001000405");
  rig.port.refuse_next = RecordingPort::kAlways;
  rig.arrive("642#4001100000000000", "000#0242");
  rig.port.refuse_next = 0;
  rig.arrive("642#4001100000000000");
  rig.pass(10 * kMillisecond).expect_silence();
  rig.arrive("000#0142");
  rig.pass(10 * kMillisecond).expect_silence();
}

// ---- TIME

TEST_CASE("TIME consumer: milliseconds after midnight and days since 1984") {
  DeviceRig rig;
  rig.start();
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

TEST_CASE("Reset communication ends TIME that an SDO download has enabled, and reports the received CAN-IDs") {
  DeviceRig rig;
  rig.start();
  rig.write(0x1012, 0, 4, 0x80000100);
  const unsigned before = rig.id_reports;
  rig.arrive("000#8242");
  rig.expect("742#00");
  CHECK(rig.id_reports == before + 1);
  rig.arrive("100#0000000001000000");
  CHECK(rig.device.time_stamp().at(rig.now) == cbcan::TimeOfDay{0, 0});
  CHECK(rig.received_ids() == std::vector<std::uint32_t>{0x000, 0x080, 0x642, 0x742});
}

TEST_CASE("A frame for none of its services makes no deadline earlier, whatever else is due; one for the node may") {
  DeviceRig rig;
  rig.start();
  rig.write(0x1017, 0, 2, 100);
  CHECK_FALSE(rig.device.on_frame(frame_from("123#00"), rig.now));
  CHECK(rig.device.on_frame(frame_from("000#0142"), rig.now));
  CHECK_FALSE(rig.device.on_frame(frame_from("080#"), rig.now));
  rig.port.refuse_next = 1;
  CHECK(rig.device.on_frame(frame_from("080#01"), rig.now));  // its EMCY waits
}

// ---- EMCY

TEST_CASE("EMCY: once for each error and once for its end; 1001h and 1003h follow") {
  DeviceRig rig;
  rig.start();
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
  DeviceRig rig;
  rig.start();
  auto& emergency = rig.device.emergency();
  rig.arrive("000#0200");
  for (std::uint16_t code = 0x1001; code <= 0x1011; ++code)
    emergency.error(code, 0, {}, rig.now);
  CHECK(emergency.counters().lost == 1);
  CHECK_FALSE(emergency.has(0x1011));
  emergency.error_over(0x1001, rig.now);  // no room for its message either
  CHECK(emergency.counters().lost == 2);
  CHECK_FALSE(emergency.has(0x1001));
  rig.arrive("000#8000");
  CHECK(rig.port.sent.size() == 16);
  rig.expect("0C2#0110010000000000");
  CHECK(rig.port.sent.back() == "0C2#1010010000000000");
  rig.port.sent.clear();
}

TEST_CASE("EMCY that the port refuses is tried again") {
  DeviceRig rig;
  rig.start();
  rig.port.refuse_next = 3;
  rig.device.emergency().error(0x1000, 0, {}, rig.now);
  rig.pass(299).expect_silence();
  rig.pass(1).expect("0C2#0010010000000000");
}

// ---- Heartbeat consumer, life guarding

TEST_CASE("1016h: a node once; entries without a node or without a time are unused, whatever else they say") {
  DeviceRig rig;
  rig.start(true);
  rig.write({{0x1016, 1, 4, 0x00050064},
             {0x1016, 2, 4, 0x000503E8, "06040043"},
             {0x1016, 1, 4, 0x000503E8},
             {0x1016, 2, 4, 0x00050000},
             {0x1016, 3, 4, 0x00000064},
             {0x1016, 3, 4, 0x00800064},
             {0x1016, 3, 4, 0x007F0064}});
  CHECK(rig.received_ids() == std::vector<std::uint32_t>{0x000, 0x080, 0x642, 0x705, 0x742, 0x77F});
}

TEST_CASE("1016h: only a heartbeat of the watched node keeps it alive") {
  DeviceRig rig;
  rig.start(true);
  rig.write(0x1016, 1, 4, 0x00050064);
  rig.arrive("705#05");
  rig.pass(99 * kMillisecond);
  rig.arrive("705#", "705#R1", "706#05", "00000705#05", "700#05", "685#05");
  rig.events.clear();
  rig.pass(kMillisecond).expect("0C2#3081110000000000");
  CHECK(rig.events == std::vector<std::string>{"lost heartbeat", "state 127"});
  rig.arrive("705#").expect_silence();
}

TEST_CASE("Node guarding: the toggle bit alternates; life guarding watches the master") {
  DeviceRig rig;
  rig.start(true);
  rig.write({{0x100C, 0, 2, 100}, {0x100D, 0, 1, 3}});
  rig.pass(kSecond).expect_silence();  // it begins with the first request
  rig.arrive("742#R1").expect("742#05");
  rig.pass(299 * kMillisecond);
  rig.arrive("742#R1").expect("742#85");
  rig.events.clear();
  rig.pass(300 * kMillisecond).expect("0C2#3081110000000000");
  CHECK(rig.events == std::vector<std::string>{"lost guarding", "state 127"});
  rig.arrive("742#R1").expect("742#7F", "0C2#0000000000000000");
  rig.arrive("000#8242").expect("742#00");
  rig.arrive("742#R1").expect("742#7F");  // the toggle bit has been reset
  rig.write(0x1017, 0, 2, 1000);
  rig.arrive("742#R1").expect_silence();  // it has a heartbeat
}

TEST_CASE("Bus-off is a network failure too, once; back on the bus it is reported, by EMCY 8140h") {
  DeviceRig rig;
  rig.start(true);
  rig.device.on_bus_state(BusState::kBusOff, rig.now);
  rig.device.on_bus_state(BusState::kBusOff, rig.now);
  CHECK(rig.events == std::vector<std::string>{"lost bus-off", "state 127"});
  rig.device.on_bus_state(BusState::kActive, rig.now);
  rig.expect("0C2#4081110000000000", "0C2#0000000000000000");
}

TEST_CASE("A slave alone answers SDO requests, except in Stopped") {
  PlainApplication<Application> rig;
  Slave slave(0x42, {rig.entries, rig.values, {}}, rig.buffer, rig, rig.port);
  slave.start(0);
  rig.expect("742#00");
  const auto arrive = [&](const char* frame) { slave.on_frame(frame_from(frame), 0); };
  arrive("642#4001200000000000");
  rig.expect("5C2#4F01200007000000");
  arrive("642#4002200000000000");
  rig.expect("5C2#8002200000000008");
  arrive("000#0242");
  arrive("642#4001200000000000");
  rig.expect_silence();
  arrive("000#8042");
  arrive("642#4001200000000000");
  rig.expect("5C2#4F01200007000000");
}

TEST_CASE(
    "A device whose application overrides only restore() stores nothing, and reacts to bus-off as CiA 301 "
    "says") {
  PlainApplication<DeviceApplication> rig;
  Device device(0x42, {rig.entries, rig.values, {}}, {rig.buffer, {}, {}}, rig, rig.port);
  device.start(0);
  device.on_frame(frame_from("642#2310100173617665"), 0);
  device.on_frame(frame_from("000#0142"), 0);
  device.poll(0);
  rig.expect("742#00", "5C2#8010100120000008");
  device.on_bus_state(BusState::kBusOff, 0);
  device.on_bus_state(BusState::kActive, 0);
  device.on_frame(frame_from("742#R1"), 0);
  device.poll(0);
  rig.expect("742#7F");
}

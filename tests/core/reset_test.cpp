// SPDX-License-Identifier: MIT
// A device between an NMT reset, or power-on, and its boot-up message.

#include "core/device_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

TEST_CASE("A reset by NMT takes several calls of poll(); until the last the node hears and sends nothing") {
  const bool whole = GENERATE(true, false);
  DeviceRig rig;
  rig.start(true);
  rig.write({{0x2001, 0, 1, 0x12}, {0x1017, 0, 2, 100}});
  rig.events.clear();
  rig.device.on_frame(frame_from(whole ? "000#8142" : "000#8242"), rig.now);
  unsigned polls = 0;
  for (; rig.device.state() == nmt::State::kInitialising; ++polls) {
    CHECK(rig.device.deadline() <= rig.now);
    for (const char* const frame : {"642#4001100000000000", "000#0142", "000#8142", "080#"})
      CHECK_FALSE(rig.device.on_frame(frame_from(frame), rig.now));
    rig.device.on_bus_state(BusState::kErrorPassive, rig.now);
    rig.expect_silence();
    rig.device.poll(rig.now);
  }
  CHECK(polls == 8);  // the values, six parts, the end; there are no PDOs
  rig.expect("742#00");
  CHECK(rig.events == std::vector<std::string>{"state 0", "state 127"});
  rig.reads({{0x2001, 0, whole ? 0u : 0x12u}, {0x1017, 0, 0}});
  rig.pass(kSecond).expect_silence();
}

TEST_CASE(
    "A boot-up message that the port refuses comes before all else, and commands from within after it") {
  const bool by_reset = GENERATE(true, false);
  DeviceRig rig;
  if (by_reset) rig.start(true);
  rig.port.refuse_next = RecordingPort::kAlways;
  by_reset ? void(rig.device.on_frame(frame_from("000#8142"), rig.now)) : rig.device.start(rig.now);
  rig.pass(0);
  for (const char* const frame : {"642#4001100000000000", "000#0142", "080#"})
    rig.device.on_frame(frame_from(frame), rig.now);
  rig.device.emergency().error(0x1000, 1, {}, rig.now);
  rig.device.slave().command(nmt::Command::kStart, rig.now);
  rig.pass(kSecond).expect_silence();
  CHECK(rig.device.state() == nmt::State::kInitialising);
  rig.port.refuse_next = 0;
  rig.pass(10 * kMillisecond).expect("742#00", "0C2#0010010000000000");
  CHECK(rig.device.state() == nmt::State::kOperational);
}

TEST_CASE("An error that is reported while the node is being reset is reported after the boot-up message") {
  const bool whole = GENERATE(true, false);
  const unsigned polls = GENERATE(range(0u, 8u));
  DeviceRig rig;
  rig.start();
  rig.device.emergency().error(0x2000, 1, {}, rig.now);
  rig.expect("0C2#0020010000000000");
  rig.device.on_frame(frame_from(whole ? "000#8142" : "000#8242"), rig.now);
  for (unsigned k = 0; k != polls; ++k)
    rig.device.poll(rig.now);
  rig.device.emergency().error(0x2310, 2, {0x12, 0x34}, rig.now);
  rig.pass(0).expect("742#00", "0C2#1023031234000000");
  rig.reads({{0x1001, 0, 3}, {0x1003, 0, 1}, {0x1003, 1, 0x34122310}});
  CHECK(rig.device.emergency().has(0x2000) == !whole);
}

TEST_CASE("A reset of the application is not lost by one of the communication within it, or before it") {
  const auto [first, second] = GENERATE(
      table<nmt::Command, nmt::Command>({{nmt::Command::kResetNode, nmt::Command::kResetCommunication},
                                         {nmt::Command::kResetCommunication, nmt::Command::kResetNode}}));
  DeviceRig rig;
  rig.start(true);
  rig.write({{0x2001, 0, 1, 0x12}});
  rig.device.emergency().error(0x2000, 1, {}, rig.now);
  rig.expect("0C2#0020010000000000");
  for (const nmt::Command command : {first, second}) {
    rig.device.slave().command(command, rig.now);
    rig.device.poll(rig.now);
  }
  rig.pass(0).expect("742#00");
  rig.reads({{0x2001, 0, 0}, {0x1001, 0, 0}});
}

TEST_CASE("bus-off that begins during a reset is a network failure") {
  DeviceRig rig;
  rig.start();
  rig.device.on_frame(frame_from("000#8242"), rig.now);
  rig.device.on_bus_state(BusState::kBusOff, rig.now);
  rig.pass(0).expect("742#00");
  rig.events.clear();
  rig.device.on_bus_state(BusState::kBusOff, rig.now);
  CHECK(rig.events == std::vector<std::string>{"lost bus-off"});
}

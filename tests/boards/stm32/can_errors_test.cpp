// SPDX-License-Identifier: MIT
#include "boards/stm32/can_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

TEST_CASE("errors: passive and active again") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.fail(15);
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);  // TEC = 120: warning, which has no name in the contract
  CHECK_FALSE(rig.model.line());
  rig.fail(1);
  CHECK(rig.model.line());
  rig.can.on_interrupt();
  CHECK_FALSE(rig.model.line());
  CHECK(rig.poll() == rig.now + kMillisecond);  // polls again: no interrupt reports recovery
  CHECK(rig.can.state() == BusState::kErrorPassive);
  CHECK(rig.sent() == "601#");
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);
}

TEST_CASE("errors: passive because of what is received") {
  StartedRig rig;
  rig.model.receive_error(CanRig::Model::kCrc, 200);
  rig.poll();
  CHECK(rig.can.state() == BusState::kErrorPassive);
  rig.hear(frame_from("581#"));
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);
}

TEST_CASE("bus-off: frames in mailboxes are cancelled, none is accepted, and none is sent afterwards") {
  StartedRig rig;
  CHECK(rig.send("000#0100"));
  CHECK(rig.send("601#"));
  CHECK(rig.send("602#"));
  rig.fail(32);
  CHECK(rig.model.line());
  rig.can.on_interrupt();
  rig.poll();
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK_FALSE(rig.send("603#"));
  rig.let_it_ask();
  CHECK(rig.can.counters().taken_back == 3);
  CHECK(rig.can.counters().sent == 0);
  CHECK(rig.can.counters().bus_off == 1);

  rig.poll(10 * 60 * kSecond);  // the bus is shorted for ten minutes
  CHECK(rig.can.state() == BusState::kBusOff);
  rig.model.recessive(11);
  CHECK_FALSE(rig.hear(frame_from("581#")));
  rig.model.recessive(128 * 11 - 1);
  rig.poll();
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK_FALSE(rig.send("603#"));
  rig.model.recessive(1);
  CHECK(rig.poll() == cbcan::kNever);
  CHECK(rig.can.state() == BusState::kActive);
  CHECK(rig.sent().empty());
  CHECK(rig.send("603#"));
  CHECK(rig.sent() == "603#");
  CHECK(rig.can.counters().bus_off == 1);
}

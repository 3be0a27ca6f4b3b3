// SPDX-License-Identifier: MIT
#include "boards/stm32f4/bxcan_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

constexpr std::uint32_t kTsr = 0x008;
constexpr std::uint32_t kAllEmpty = 0x1C000000;

/// Polls until the driver waits for the bus.
void let_it_ask(BxCanRig& rig) {
  for (int i = 0; i < 10; ++i)
    rig.poll(kMillisecond);
}

}  // namespace

TEST_CASE("errors: passive and active again") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.fail(15);
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);  // TEC = 120: warning, which has no name in the contract
  CHECK_FALSE(rig.model.sce_line());
  rig.fail(1);
  CHECK(rig.model.sce_line());
  rig.can.on_error_interrupt();
  CHECK_FALSE(rig.model.sce_line());
  CHECK(rig.poll() == rig.now + kMillisecond);  // polls again: no interrupt reports recovery
  CHECK(rig.can.state() == BusState::kErrorPassive);
  CHECK(rig.sent() == "601#");
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);
}

TEST_CASE("errors: passive because of what is received") {
  StartedRig rig;
  rig.model.receive_error(BxCanRig::Model::kCrc, 200);
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
  CHECK(rig.model.sce_line());
  rig.can.on_error_interrupt();
  CHECK((rig.model.read(kTsr) & kAllEmpty) == 0);
  rig.poll();
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK((rig.model.read(kTsr) & kAllEmpty) == kAllEmpty);
  CHECK_FALSE(rig.send("603#"));
  let_it_ask(rig);
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

TEST_CASE("bus-off: the controller is not asked to recover before every mailbox is empty") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.fail(32);
  // A frame accepted at the moment of bus-off, before the loop has seen it.
  CHECK(rig.send("000#0100"));
  rig.poll();
  CHECK((rig.model.read(0x000) & 1) == 0);  // not yet INRQ
  rig.poll();
  CHECK((rig.model.read(0x000) & 1) == 1);
  CHECK((rig.model.read(kTsr) & kAllEmpty) == kAllEmpty);
  let_it_ask(rig);
  CHECK((rig.model.read(0x000) & 1) == 0);
  rig.model.recessive(129 * 11);
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);
  CHECK(rig.sent().empty());
}

TEST_CASE("bus-off: an abort that the controller does not do at once is waited for") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  CHECK(rig.send("602#"));
  rig.fail(32);
  rig.model.abort_held = true;
  let_it_ask(rig);
  CHECK((rig.model.read(0x000) & 1) == 0);  // no INRQ
  CHECK(rig.can.state() == BusState::kBusOff);
  rig.model.abort_held = false;
  let_it_ask(rig);
  CHECK(rig.can.counters().taken_back == 2);
  rig.model.recessive(129 * 11);
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);
  CHECK(rig.sent().empty());
}

TEST_CASE("bus-off: a controller that does not empty its mailboxes is abandoned after 200 ms") {
  StartedRig rig;
  rig.poll(10 * kSecond);
  CHECK(rig.send("000#0100"));
  rig.fail(32);
  rig.model.abort_held = true;
  rig.poll();
  for (int ms = 0; ms < 200; ++ms) {
    CHECK_FALSE(rig.can.stopped());
    const Time due = rig.poll(kMillisecond);
    CHECK(due <= rig.now + kMillisecond);
  }
  CHECK(rig.can.stopped());
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK(rig.can.counters().given_up == 1);
  rig.model.hold_in_reset(true);  // empties the mailboxes for certain
  rig.model.hold_in_reset(false);
  rig.model.abort_held = false;
  rig.start();
  CHECK(rig.sent().empty());
}

// SPDX-License-Identifier: MIT

#include "boards/stm32/can_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

TEST_CASE("init: on the bus after 11 recessive bits, until then bus-off and no frame taken") {
  CanRig rig;
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK_FALSE(rig.send("000#0100"));  // before init
  rig.poll();
  rig.init(1);
  rig.model.recessive(10);
  CHECK(rig.poll() == rig.now + 1000);
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK_FALSE(rig.send("000#0100"));
  rig.model.recessive(1);
  CHECK(rig.poll() == cbcan::kNever);
  CHECK(rig.can.state() == BusState::kActive);
  CHECK(rig.can.counters().bus_off == 0);
  CHECK(rig.send("000#0100"));
}

TEST_CASE("init: a bit rate that the clock does not give is refused") {
  CanRig rig;
  CHECK_FALSE(rig.can.init(45'000'000, 800'000, 1, 0));
  CHECK(rig.model.read(numbers::kMode) == numbers::kModeReset);  // untouched
  CHECK(rig.can.stopped());
}

TEST_CASE("init: a controller that does not respond is abandoned after 200 ms, each time counted") {
  CanRig rig;
  rig.model.init_refused = true;
  for (std::uint32_t times = 1; times <= 3; ++times) {
    REQUIRE(rig.can.init(numbers::kCanClock, 500'000, 1, rig.now));
    for (int ms = 0; ms < 200; ++ms) {
      CHECK_FALSE(rig.can.stopped());
      rig.poll(kMillisecond);
    }
    CHECK(rig.can.stopped());
    CHECK(rig.can.counters().given_up == times);
    CHECK(rig.can.state() == BusState::kBusOff);
    CHECK_FALSE(rig.send("000#0100"));
    CHECK(rig.poll(kMillisecond) == cbcan::kNever);
  }
  rig.model.init_refused = false;
  rig.start();
}

TEST_CASE("stop: in the registers' reset state it is off the bus, and takes nothing") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.model.hold_in_reset(true);
  CHECK_FALSE(rig.send("602#"));  // before the loop has seen it
  rig.can.stop();
  CHECK(rig.can.stopped());
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK_FALSE(rig.send("602#"));
  CHECK(rig.poll(10 * kMillisecond) == cbcan::kNever);
  rig.model.hold_in_reset(false);
  rig.start();
  CHECK(rig.sent().empty());
  CHECK(rig.send("603#"));
  CHECK(rig.sent() == "603#");
}

// SPDX-License-Identifier: MIT
// The driver of the Zynq UltraScale+ CAN controller against a model of it. Register values are derived by
// hand from UG1087.
#include "boards/drivers/zynqmp_can.hpp"

#include "boards/model_registers.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"
#include "zynqmp_can_model.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::test;
using Registers = ModelRegisters<ZynqmpCanModel>;
using Can = boards::ZynqmpCan<Registers>;
using Words = ZynqmpCanModel::Words;

constexpr std::uint32_t kClock = 24'000'000;

struct Rig {
  Rig() { REQUIRE(can.start({kClock, 500'000, 0x7F}) == Can::Start::kDone); }
  /// An 11-bit frame without data.
  bool arrive(std::uint32_t id, std::uint32_t bits = 0) { return model.arrive({id << 21 | bits, 0, 0, 0}); }
  std::string next() {
    Frame frame;
    return can.receive(frame) ? text_of(frame) : "none";
  }
  ZynqmpCanModel model;
  Can can{Registers(model)};
};

}  // namespace

TEST_CASE("ZynqMP CAN: the bit rates of CiA 301 from 24 MHz") {
  // BRPR = prescaler - 1; BTR = SJW - 1 in 8:7, TS2 - 1 in 6:4, TS1 - 1 in 3:0. 16 quanta are 1 + 13 + 2, 8
  // are 1 + 6 + 1.
  struct Row {
    std::uint32_t rate, brpr, btr;
  };
  for (const Row& row : {Row{10'000, 149, 0x9C}, Row{20'000, 74, 0x9C}, Row{50'000, 29, 0x9C},
                         Row{100'000, 14, 0x9C}, Row{125'000, 11, 0x9C}, Row{250'000, 5, 0x9C},
                         Row{500'000, 2, 0x9C}, Row{800'000, 1, 0x9B}, Row{1'000'000, 2, 0x05}}) {
    CAPTURE(row.rate);
    ZynqmpCanModel model;
    Can can{Registers(model)};
    CHECK(can.start({kClock, row.rate, 1}) == Can::Start::kDone);
    CHECK(model.prescaler == row.brpr);
    CHECK(model.timing == row.btr);
    CHECK(model.mode == 0);
    CHECK(!model.is_configuring());
  }
}

TEST_CASE("ZynqMP CAN: a bit rate that the clock does not make is refused before anything is touched") {
  for (const std::uint32_t rate : {0u, 1'000u, 1'300'000u, 6'000'000u}) {
    CAPTURE(rate);  // 0; a prescaler above 256; 18.46 clocks; 4 of them
    ZynqmpCanModel model;
    Can can{Registers(model)};
    CHECK(can.start({kClock, rate, 1}) == Can::Start::kBitRate);
    CHECK(model.resets == 0);
  }
}

TEST_CASE("ZynqMP CAN: a controller without a clock, or whose filters stay busy, is reported") {
  ZynqmpCanModel model;
  Can can{Registers(model)};
  model.has_clock = false;
  CHECK(can.start({kClock, 500'000, 1}) == Can::Start::kNoReset);
  model.has_clock = true;
  model.filters_stuck = true;
  CHECK(can.start({kClock, 500'000, 1}) == Can::Start::kNoReset);
}

TEST_CASE("ZynqMP CAN: the filters let through what the core looks at") {
  Rig rig;
  REQUIRE(rig.can.start({kClock, 500'000, 0x42}) == Can::Start::kDone);
  for (const std::uint32_t id :
       {0x000u, 0x080u, 0x100u, 0x181u, 0x3FFu, 0x400u, 0x57Fu, 0x581u, 0x5FFu, 0x642u, 0x701u, 0x77Fu}) {
    CAPTURE(id);
    CHECK(rig.arrive(id));
    CHECK(rig.arrive(id, 1u << 20));              // RTR
    CHECK(!rig.arrive(id, 1u << 20 | 1u << 19));  // 29 bits
  }
  for (const std::uint32_t id : {0x600u, 0x641u, 0x643u, 0x67Fu, 0x680u, 0x6FFu, 0x780u, 0x7E4u, 0x7FFu}) {
    CAPTURE(id);
    CHECK(!rig.arrive(id));
  }
}

TEST_CASE("ZynqMP CAN: frames to words") {
  Rig rig;
  CHECK(rig.can.try_send(frame_from("605#4017100055AA0102")));
  CHECK(rig.can.try_send(frame_from("000#0100")));
  CHECK(rig.can.try_send(frame_from("742#R1")));
  CHECK(rig.can.try_send(frame_from("1ABCDEF1#00")));  // 1ABCDEF1h = 6AFh << 18 | 0DEF1h
  CHECK(rig.can.try_send(frame_from("00000001#R0")));
  REQUIRE(rig.model.tx.size() == 5);
  CHECK(rig.model.tx[0] == Words{0xC0A00000, 0x80000000, 0x40171000, 0x55AA0102});
  CHECK(rig.model.tx[1] == Words{0x00000000, 0x20000000, 0x01000000, 0});
  CHECK(rig.model.tx[2] == Words{0xE8500000, 0x10000000, 0, 0});
  CHECK(rig.model.tx[3] == Words{0xD5F9BDE2, 0x10000000, 0, 0});
  CHECK(rig.model.tx[4] == Words{0x00180003, 0, 0, 0});
}

TEST_CASE("ZynqMP CAN: words to frames, in order, by the interrupt") {
  Rig rig;
  CHECK(!rig.model.interrupt());
  CHECK(!rig.can.has_received());
  rig.model.filters_used = 0;
  rig.model.arrive(
      {0xB0A00000, 0x80001234, 0x43171000, 0xE8030000});      // a time stamp in the lower half of DLC
  rig.model.arrive({0xE8500000, 0x10000000, 0xFF000000, 0});  // remote: no data, whatever the words say
  rig.model.arrive({0xD5F9BDE2, 0x10000000, 0x7F000000, 0});
  rig.model.arrive({0x00180003, 0x20000000, 0, 0});
  rig.model.arrive({0xE0200000, 0xF0000000, 0x01020304, 0x05060708});  // DLC 15 means 8
  CHECK(rig.model.interrupt());
  CHECK(rig.next() == "none");
  rig.can.on_interrupt();
  CHECK(!rig.model.interrupt());
  CHECK(rig.can.has_received());
  CHECK(rig.next() == "585#43171000E8030000");
  CHECK(rig.next() == "742#R1");
  CHECK(rig.next() == "1ABCDEF1#7F");
  CHECK(rig.next() == "00000001#R2");
  CHECK(rig.next() == "701#0102030405060708");
  CHECK(rig.next() == "none");
}

TEST_CASE("ZynqMP CAN: a full transmit FIFO refuses, and takes again when a frame has left") {
  Rig rig;
  const Frame frame = frame_from("000#0100");
  for (unsigned i = 0; i < 64; ++i)
    REQUIRE(rig.can.try_send(frame));
  CHECK(!rig.can.try_send(frame));
  CHECK(rig.model.tx.size() == 64);
  rig.model.transmit();
  CHECK(rig.can.try_send(frame));
  CHECK(!rig.can.try_send(frame));
}

TEST_CASE("ZynqMP CAN: an overflow of the receive FIFO is counted and told for a second") {
  Rig rig;
  CHECK(rig.can.poll(1'000) == BusState::kActive);
  for (unsigned i = 0; i < 100; ++i)
    rig.arrive(0x701);
  CHECK(rig.can.poll(1'500) == BusState::kActive);  // the interrupt is late
  rig.can.on_interrupt();
  CHECK(!rig.model.interrupt());
  CHECK(rig.can.poll(2'000) == BusState::kOverflow);
  CHECK(rig.can.counters().overflows == 1);
  CHECK(rig.can.poll(1'001'999) == BusState::kOverflow);
  CHECK(rig.can.poll(1'002'000) == BusState::kActive);
  unsigned kept = 0;
  while (rig.next() == "701#")
    ++kept;
  CHECK(kept == 64);
}

TEST_CASE("ZynqMP CAN: a loop that does not fetch its frames overflows the ring, not the FIFO") {
  Rig rig;
  for (unsigned i = 0; i < 65; ++i) {
    rig.arrive(0x701);
    rig.can.on_interrupt();
  }
  CHECK(rig.model.rx.empty());
  CHECK(rig.can.poll(0) == BusState::kOverflow);
  CHECK(rig.can.counters().overflows == 1);
}

TEST_CASE("ZynqMP CAN: error states") {
  Rig rig;
  rig.model.error_counters = 0x6007;  // REC, TEC
  CHECK(rig.can.receive_errors() == 0x60);
  CHECK(rig.can.transmit_errors() == 7);
  CHECK(rig.can.poll(0) == BusState::kActive);
  rig.model.set_error_state(3);
  CHECK(rig.can.poll(0) == BusState::kErrorPassive);
  CHECK(rig.can.try_send(frame_from("000#0100")));
  rig.model.set_error_state(1);
  CHECK(rig.can.poll(0) == BusState::kActive);
}

TEST_CASE("ZynqMP CAN: bus-off wakes the loop, refuses frames, and ends with a reset after 200 ms") {
  Rig rig;
  REQUIRE(rig.can.try_send(frame_from("000#0200")));
  rig.model.set_error_state(2);
  CHECK(rig.model.interrupt());
  rig.can.on_interrupt();
  CHECK(!rig.model.interrupt());
  CHECK(!rig.can.try_send(frame_from("000#0100")));
  CHECK(rig.can.poll(1'000) == BusState::kBusOff);
  CHECK(rig.can.poll(200'999) == BusState::kBusOff);
  CHECK(rig.model.resets == 1);
  CHECK(rig.can.poll(201'000) == BusState::kBusOff);
  CHECK(rig.model.resets == 2);
  CHECK(rig.model.tx.empty());  // nothing old is sent
  CHECK(rig.model.prescaler == 2);
  CHECK(rig.model.timing == 0x9C);
  CHECK(rig.can.poll(201'100) == BusState::kActive);
  CHECK(rig.can.counters().bus_offs == 1);
  CHECK(rig.can.try_send(frame_from("000#0100")));
  CHECK(rig.arrive(0x67F));
  CHECK(!rig.arrive(0x601));
  CHECK(rig.model.interrupt());
  // The second time is like the first.
  rig.model.set_error_state(2);
  CHECK(rig.can.poll(1'000'000) == BusState::kBusOff);
  CHECK(rig.can.poll(1'100'000) == BusState::kBusOff);
  CHECK(rig.model.resets == 2);
}

TEST_CASE("ZynqMP CAN: a reset that does not succeed is tried again") {
  Rig rig;
  rig.model.set_error_state(2);
  rig.can.poll(0);
  rig.model.filters_stuck = true;
  CHECK(rig.can.poll(200'000) == BusState::kBusOff);
  CHECK(rig.can.poll(200'100) == BusState::kBusOff);
  CHECK(!rig.can.try_send(frame_from("000#0100")));
  rig.model.filters_stuck = false;
  CHECK(rig.can.poll(400'100) == BusState::kBusOff);
  CHECK(rig.can.poll(400'200) == BusState::kActive);
  CHECK(rig.can.try_send(frame_from("000#0100")));
}

TEST_CASE("ZynqMP CAN: frames without acknowledgement for a second are discarded") {
  Rig rig;
  const Frame frame = frame_from("000#0100");
  REQUIRE(rig.can.try_send(frame));
  rig.model.transmit();
  REQUIRE(rig.can.try_send(frame));
  REQUIRE(rig.can.try_send(frame));
  rig.can.poll(0);
  rig.can.poll(900'000);
  rig.model.transmit();  // one frame is sent: the second starts again
  rig.can.poll(999'000);
  rig.can.poll(1'998'999);
  CHECK(rig.model.tx.size() == 1);
  CHECK(rig.can.counters().stuck == 0);
  rig.model.set_error_state(3);
  CHECK(rig.can.poll(1'999'000) == BusState::kErrorPassive);
  CHECK(rig.model.tx.empty());
  CHECK(rig.can.counters().stuck == 1);
  CHECK(rig.model.resets == 2);
  CHECK(rig.can.poll(1'999'100) == BusState::kActive);
  CHECK(rig.can.poll(9'000'000) == BusState::kActive);
  CHECK(rig.model.resets == 2);
}

// SPDX-License-Identifier: MIT
// The driver of the SJA1000 against a model of it. Register values are derived by hand from its data sheet.
#include "boards/drivers/sja1000.hpp"

#include "boards/model_registers.hpp"
#include "sja1000_model.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::test;
using Registers = ModelRegisters<Sja1000Model>;
using Can = boards::Sja1000<Registers>;
using Bytes = Sja1000Model::Bytes;

struct Rig {
  Rig() { REQUIRE(can.start({8'000'000, 500'000, 0x42}) == Can::Start::kDone); }
  /// An 11-bit frame without data.
  void arrive(unsigned id, unsigned info = 0) {
    model.arrive({static_cast<std::uint8_t>(info), static_cast<std::uint8_t>(id >> 3),
                  static_cast<std::uint8_t>(id << 5)});
  }
  std::string next() {
    can.on_interrupt();
    CHECK(!model.interrupt());
    Frame frame;
    return can.receive(frame) ? text_of(frame) : "none";
  }
  Sja1000Model model;
  Can can{Registers(model)};
};

}  // namespace

TEST_CASE("SJA1000: bit timing, modes, and what no clock makes") {
  // BTR0: SJW - 1 in 7:6, BRP - 1 in 5:0; BTR1: TSEG2 - 1 in 6:4, TSEG1 - 1 in 3:0. 16 quanta are 1 + 13 + 2,
  // 10 are 1 + 8 + 1, 8 are 1 + 6 + 1.
  struct Row {
    std::uint32_t clock, rate, btr0, btr1;
  };
  for (const Row& row : {Row{8'000'000, 10'000, 0x71, 0x1C}, Row{8'000'000, 20'000, 0x58, 0x1C},
                         Row{8'000'000, 50'000, 0x49, 0x1C}, Row{8'000'000, 125'000, 0x43, 0x1C},
                         Row{8'000'000, 250'000, 0x41, 0x1C}, Row{8'000'000, 500'000, 0x40, 0x1C},
                         Row{8'000'000, 800'000, 0x00, 0x07}, Row{8'000'000, 1'000'000, 0x00, 0x05},
                         Row{40'000'000, 1'000'000, 0x04, 0x05}}) {
    CAPTURE(row.rate);
    Sja1000Model model;
    Can can{Registers(model)};
    CHECK(can.start({row.clock, row.rate, 1}) == Can::Start::kDone);
    CHECK(unsigned{model.registers[6]} == row.btr0);
    CHECK(unsigned{model.registers[7]} == row.btr1);
    CHECK(unsigned{model.registers[31]} == 0xC0);
    CHECK(unsigned{model.registers[8]} == 0x1A);
    CHECK(unsigned{model.registers[4]} == 0x25);
    CHECK(model.mode == 0);  // two filters; no sleep, no listening only
    CHECK(model.filter == std::array<std::uint8_t, 8>{0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF});
  }
  Sja1000Model model;
  Can can{Registers(model)};
  CHECK(can.start({40'000'000, 10'000, 1}) == Can::Start::kBitRate);  // a prescaler above 64
  CHECK(can.start({8'000'000, 0, 1}) == Can::Start::kBitRate);
  CHECK(model.is_resetting());
  CHECK(!can.try_send(frame_from("000#0100")));
  for (const std::uint8_t nothing : std::array<std::uint8_t, 2>{0x00, 0xFF}) {
    model.nobody = nothing;
    CHECK(can.start({8'000'000, 500'000, 1}) == Can::Start::kNoReset);
  }
}

TEST_CASE("SJA1000: frames to the transmit buffer, one at a time") {
  Rig rig;
  struct Row {
    const char* frame;
    Bytes bytes;
  };
  for (const Row& row :
       {Row{"605#4017100055AA0102", {0x08, 0xC0, 0xA0, 0x40, 0x17, 0x10, 0, 0x55, 0xAA, 1, 2}},
        Row{"000#0100", {0x02, 0, 0, 1, 0}}, Row{"742#R1", {0x41, 0xE8, 0x40}},
        Row{"1ABCDEF1#7F", {0x81, 0xD5, 0xE6, 0xF7, 0x88, 0x7F}},
        Row{"00000001#R0", {0xC0, 0, 0, 0, 0x08}}}) {
    CAPTURE(row.frame);
    CHECK(rig.can.try_send(frame_from(row.frame)));
    CHECK(rig.model.tx == row.bytes);
    CHECK(!rig.can.try_send(frame_from("000#0200")));
    rig.model.transmit();
  }
}

TEST_CASE("SJA1000: what the core looks at comes from the receive FIFO, and nothing else") {
  Rig rig;
  rig.model.arrive({0x08, 0xB0, 0xA0, 0x43, 0x17, 0x10, 0, 0xE8, 3, 0, 0});
  rig.arrive(0x742, 0x41);  // remote: no data, whatever its length
  CHECK(rig.model.interrupt());
  CHECK(rig.next() == "585#43171000E8030000");
  CHECK(rig.next() == "742#R1");
  rig.model.arrive({0x0F, 0xE0, 0x20, 1, 2, 3, 4, 5, 6, 7, 8});  // DLC 15 means 8
  CHECK(rig.next() == "701#0102030405060708");
  for (const unsigned id :
       {0x000u, 0x080u, 0x100u, 0x181u, 0x57Fu, 0x5FFu, 0x642u, 0x680u, 0x6FFu, 0x77Fu, 0x7E4u, 0x7E5u}) {
    CAPTURE(id);
    rig.arrive(id);
    rig.arrive(id, 0x40);
    CHECK(rig.next() != "none");
    CHECK(rig.next() != "none");
  }
  for (const unsigned id : {0x600u, 0x641u, 0x643u, 0x67Fu, 0x780u, 0x7E3u, 0x7E6u, 0x7FFu}) {
    CAPTURE(id);
    rig.arrive(id);
    CHECK(rig.next() == "none");
  }
  rig.model.arrive({0x81, 0, 0, 0, 0x08, 0x7F});  // 29 bits
  CHECK(rig.next() == "none");
  CHECK(rig.model.rx.empty());
}

TEST_CASE("SJA1000: lost frames are reported for a second, whether the FIFO or the ring was full") {
  Rig rig;
  for (unsigned i = 0; i < 22; ++i)  // 21 times 3 bytes fit
    rig.arrive(0x701);
  CHECK(rig.can.poll(1'500) == BusState::kActive);  // the interrupt is late
  CHECK(rig.model.interrupt());
  CHECK(rig.next() == "701#");
  CHECK(rig.can.poll(2'000) == BusState::kOverflow);
  CHECK(rig.can.counters().overflows == 1);
  CHECK(rig.can.poll(1'001'999) == BusState::kOverflow);
  CHECK(rig.can.poll(1'002'000) == BusState::kActive);
  for (unsigned i = 0; i < 45; ++i) {  // 20 are in the ring of 64
    rig.arrive(0x701);
    rig.can.on_interrupt();
    rig.arrive(0x601);  // takes no place
    rig.can.on_interrupt();
    CHECK(rig.can.poll(2'000'000) == (i < 44 ? BusState::kActive : BusState::kOverflow));
  }
  CHECK(rig.can.counters().overflows == 2);
}

TEST_CASE("SJA1000: error passive") {
  Rig rig;
  for (const auto& [transmit, receive, state] :
       {std::tuple{127, 127, BusState::kActive}, std::tuple{128, 0, BusState::kErrorPassive},
        std::tuple{0, 128, BusState::kErrorPassive}, std::tuple{0, 0, BusState::kActive}}) {
    rig.model.transmit_errors = static_cast<std::uint8_t>(transmit);
    rig.model.receive_errors = static_cast<std::uint8_t>(receive);
    CHECK(rig.can.poll(0) == state);
    CHECK(rig.can.transmit_errors() == transmit);
    CHECK(rig.can.receive_errors() == receive);
  }
}

TEST_CASE("SJA1000: bus-off drops what waits, refuses frames, and ends when the controller has recovered") {
  Rig rig;
  for (unsigned time = 1; time <= 2; ++time) {
    REQUIRE(rig.can.try_send(frame_from("000#0200")));
    rig.model.go_bus_off();
    CHECK(rig.model.interrupt());
    CHECK(rig.next() == "none");
    CHECK(!rig.can.try_send(frame_from("000#0100")));
    CHECK(rig.can.poll(0) == BusState::kBusOff);
    CHECK(!rig.model.is_resetting());
    CHECK(!rig.model.sending);
    CHECK(rig.model.resets == 1 + time);
    CHECK(rig.can.poll(10) == BusState::kBusOff);
    CHECK(!rig.can.try_send(frame_from("000#0100")));
    rig.model.recover();
    CHECK(rig.can.poll(20) == BusState::kActive);
    CHECK(rig.can.counters().bus_offs == time);
    CHECK(rig.can.try_send(frame_from("000#0100")));
    rig.model.transmit();
  }
}

TEST_CASE("SJA1000: a frame that bus-off interrupts on its way into the ring is none") {
  Rig rig;
  rig.model.bus_off_at = 18;  // the filters' registers are read from there on
  rig.model.arrive({0x02, 0, 0, 0x81, 5});
  rig.can.on_interrupt();
  CHECK(!rig.can.has_received());
  rig.model.nobody = 0xFF;  // then the controller is missing
  CHECK(rig.can.poll(0) == BusState::kBusOff);
  CHECK(rig.can.counters().bus_offs == 0);
}

TEST_CASE("SJA1000: a frame without acknowledgement for a second is cancelled") {
  Rig rig;
  const Frame frame = frame_from("000#0100");
  REQUIRE(rig.can.try_send(frame));
  rig.can.poll(0);
  rig.can.poll(900'000);
  rig.model.transmit();  // is sent; for the next one the second starts again
  REQUIRE(rig.can.try_send(frame));
  rig.can.poll(999'000);
  rig.can.poll(1'998'999);
  CHECK(rig.model.sending);
  rig.can.poll(1'999'000);
  CHECK(!rig.model.sending);
  CHECK(rig.can.counters().stuck == 1);
  rig.can.poll(9'000'000);
  rig.can.poll(19'000'000);
  CHECK(rig.can.counters().stuck == 1);
  CHECK(rig.model.resets == 1);
}

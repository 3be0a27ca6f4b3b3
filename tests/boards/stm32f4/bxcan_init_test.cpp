// SPDX-License-Identifier: MIT
// The registers after init(): expected values derived by hand from the bit definitions of RM0390, 30.9.

#include "boards/stm32f4/bxcan_rig.hpp"

using namespace cbcan;
using cbcan::boards::bit_timing;
using cbcan::boards::BitTiming;
using cbcan::boards::stm32f4::bxcan::btr;
using cbcan::boards::stm32f4::bxcan::kMostPrescaler;
using namespace cbcan::test;

TEST_CASE("bit timing: BTR from the clock of APB1 and the bit rate") {
  struct Row {
    std::uint32_t clock, bit_rate, btr;
  };
  // BTR: SJW-1 in 25:24, TS2-1 in 22:20, TS1-1 in 19:16, BRP-1 in 9:0.
  for (const Row& row : {
           // 40 MHz: 16 quanta, sampled after 14, or 8 after 7: 87.5 %; 800k: 10 after 9.
           Row{40'000'000, 10'000, 0x011C00F9},
           Row{40'000'000, 500'000, 0x011C0004},
           Row{40'000'000, 800'000, 0x00070004},
           Row{40'000'000, 1'000'000, 0x00050004},
           // 45 MHz: 15 quanta, sampled after 13: 86.7 %; 125k: 8 after 7.
           Row{45'000'000, 1'000'000, 0x011B0002},
           Row{45'000'000, 125'000, 0x0005002C},
           // 42 MHz: 14 quanta, sampled after 12: 85.7 %.
           Row{42'000'000, 1'000'000, 0x011A0002},
       }) {
    INFO(row.clock << " Hz, " << row.bit_rate << " bit/s");
    const auto timing = bit_timing(row.clock, row.bit_rate, kMostPrescaler);
    REQUIRE(timing);
    CHECK(btr(*timing) == row.btr);
  }
}

TEST_CASE("bit timing: the longest SJW is 4, the largest prescaler 1024") {
  CHECK(btr(BitTiming{1, 10, 5}) == 0x03490000);
  CHECK(btr(BitTiming{1024, 16, 8}) == 0x037F03FF);
}

TEST_CASE("init: modes, bit timing, filters and interrupts") {
  BxCanRig rig;
  rig.init(0x7F);
  const auto reg = [&](std::uint32_t offset) { return rig.model.read(offset); };
  CHECK(reg(0x000) == 0x0001000C);  // MCR: DBF, RFLM, TXFP; ABOM, NART, SLEEP, INRQ = 0
  CHECK(reg(0x01C) == 0x011C0004);  // BTR
  CHECK(reg(0x014) == 0x00008612);  // IER: ERRIE, BOFIE, EPVIE, FMPIE1, FMPIE0
  CHECK(reg(0x018) == 0x00000070);  // ESR: LEC = 7
  CHECK(reg(0x200) == 0x2A1C0E00);  // FMR: FINIT = 0, CAN2SB unchanged
  CHECK(reg(0x204) == 0x2);         // FM1R: bank 1 is a list
  CHECK(reg(0x20C) == 0x0);         // FS1R: 16 bits
  CHECK(reg(0x214) == 0xC);         // FFA1R: banks 2 and 3 to FIFO 1
  CHECK(reg(0x21C) == 0xF);         // FA1R
  CHECK(reg(0x240) == 0xF018B000);  // 580h: 101 1000 0000 b; mask 780h, RTR, IDE
  CHECK(reg(0x244) == 0xFFF80000);  // 000h: mask 7FFh, RTR, IDE
  CHECK(reg(0x248) == 0xEFF0CFE0);  // 67Fh; 77Fh with RTR
  CHECK(reg(0x24C) == 0xFC80FCA0);  // 7E5h, 7E4h
  CHECK(reg(0x250) == 0xF018E000);  // 700h, mask 780h, RTR, IDE
  CHECK(reg(0x254) == 0xF008D000);  // 680h, mask 780h, IDE
  CHECK(reg(0x258) == 0x80080000);  // 000h, mask 400h, IDE
  CHECK(reg(0x25C) == 0xC0088000);  // 400h, mask 600h, IDE
}

TEST_CASE("init: on the bus after 11 recessive bits, until then bus-off and no frame taken") {
  BxCanRig rig;
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
  BxCanRig rig;
  CHECK_FALSE(rig.can.init(45'000'000, 800'000, 1, 0));
  CHECK(rig.model.read(0x000) == 0x00010002);  // untouched
  CHECK(rig.can.stopped());
}

TEST_CASE("init: a controller that does not respond is abandoned after 200 ms, each time counted") {
  BxCanRig rig;
  rig.model.init_refused = true;
  for (std::uint32_t times = 1; times <= 3; ++times) {
    REQUIRE(rig.can.init(40'000'000, 500'000, 1, rig.now));
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

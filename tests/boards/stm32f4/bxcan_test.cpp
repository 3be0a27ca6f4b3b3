// SPDX-License-Identifier: MIT
// What only bxCAN has: its registers, with expected values derived by hand from the bit definitions of
// RM0390, 30.9, and its mailboxes.

#include "boards/stm32/can_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;
using boards::BitTiming;
using boards::Mmio;
using boards::stm32::BxCan;
using boards::stm32::bxcan::btr;

namespace {

constexpr std::uint32_t kTsr = 0x008;
constexpr std::uint32_t kAllEmpty = 0x1C000000;

}  // namespace

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
    const auto timing = BxCan<Mmio>::timing(row.clock, row.bit_rate);
    REQUIRE(timing);
    CHECK(btr(*timing) == row.btr);
  }
}

TEST_CASE("bit timing: the longest SJW is 4, the largest prescaler 1024") {
  CHECK(btr(BitTiming{1, 10, 5}) == 0x03490000);
  CHECK(btr(BitTiming{1024, 16, 8}) == 0x037F03FF);
}

TEST_CASE("init: modes, bit timing, filters and interrupts") {
  CanRig rig;
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

TEST_CASE("transmit: a frame as it is in the mailbox, TIxR to TDHxR") {
  StartedRig rig;
  CHECK(rig.send("642#4011640100000000"));
  CHECK(rig.model.read(0x180) == 0xC8400001);  // 642h << 21, TXRQ
  CHECK(rig.model.read(0x184) == 8);
  CHECK(rig.model.read(0x188) == 0x01641140);
  CHECK(rig.model.read(0x18C) == 0x00000000);
  CHECK(rig.send("742#R1"));
  CHECK(rig.model.read(0x190) == 0xE8400003);  // RTR, TXRQ
  CHECK(rig.model.read(0x194) == 1);
  CHECK(rig.send("1ABCDEF0#1122334455667788"));
  CHECK(rig.model.read(0x1A0) == 0xD5E6F785);  // 1ABCDEF0h << 3, IDE, TXRQ
  CHECK(rig.model.read(0x1A8) == 0x44332211);
  CHECK(rig.model.read(0x1AC) == 0x88776655);
  CHECK(rig.sent() == "642#4011640100000000");
  CHECK(rig.sent() == "742#R1");
  CHECK(rig.sent() == "1ABCDEF0#1122334455667788");
}

TEST_CASE("transmit: a frame that is on the bus when it gets old may still be sent, and is counted as sent") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.poll();
  REQUIRE(rig.model.start_frame());
  CHECK(rig.poll(kSecond) == kSecond + kMillisecond);  // aborted, polls again
  rig.model.end_frame();
  CHECK(rig.poll(kMillisecond) == kNever);
  CHECK(rig.can.counters().sent == 1);
  CHECK(rig.can.counters().taken_back == 0);
}

TEST_CASE("receive: a release that takes its time loses and doubles nothing") {
  StartedRig rig;
  rig.model.release_after = 2;
  for (const char* frame : {"581#01", "582#02", "583#03"})
    REQUIRE(rig.model.arrive(frame_from(frame)));
  int interrupts = 0;
  while (rig.model.rx0_line() && ++interrupts < 20)
    rig.can.on_interrupt();
  for (const char* frame : {"581#01", "582#02", "583#03"})
    CHECK(rig.received() == frame);
  CHECK(rig.received().empty());
  CHECK(rig.can.counters().received == 3);
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
  rig.let_it_ask();
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
  rig.let_it_ask();
  CHECK((rig.model.read(0x000) & 1) == 0);  // no INRQ
  CHECK(rig.can.state() == BusState::kBusOff);
  rig.model.abort_held = false;
  rig.let_it_ask();
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

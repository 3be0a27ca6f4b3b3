// SPDX-License-Identifier: MIT
// What only FDCAN has: its registers and message RAM, with expected values derived by hand from RM0440,
// chapter 44, and what takes it off the bus.

#include "boards/stm32/can_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;
namespace fdcan = cbcan::boards::stm32::fdcan;

TEST_CASE("init: bit timing, interrupts, filters; the rest of the message RAM is cleared") {
  CanRig rig;
  rig.init(0x7F);
  CHECK(rig.model.read(0x018) == 0x00000000);  // CCCR: TXP, BRSE, FDOE, DAR, INIT = 0
  CHECK(rig.model.read(0x01C) == 0x02090C01);  // NBTP: SJW 2, prescaler 10, 13 and 2 quanta
  CHECK(rig.model.read(0x054) == 0x000A002D);  // IE: BO, EP, RF1L, RF1N, RF0L, RF0N
  CHECK(rig.model.read(0x080) == 0x00060029);  // RXGFC: 6 filters, ANFS and ANFE = reject, RRFE
  std::array<std::uint32_t, 212> ram{};
  ram[0] = 0x4800067F;  // 000h and 67Fh to FIFO 0
  ram[1] = 0x4F7F077F;  // 77Fh
  ram[2] = 0x4FE507E4;  // 7E5h and 7E4h
  ram[3] = 0x0D8005FF;  // 580h..5FFh
  ram[4] = 0x1000057F;  // 000h..57Fh to FIFO 1
  ram[5] = 0x1680077F;  // 680h..77Fh
  CHECK(rig.model.ram.words == ram);
}

TEST_CASE("init: a kernel clock that is faster than the bus is refused") {
  CanRig rig;
  CHECK_FALSE(rig.can.init(80'000'000, 64'000'000, 500'000, 1, 0));
  CHECK(rig.can.init(64'000'000, 64'000'000, 500'000, 1, 0));
}

TEST_CASE("transmit: a frame as it is in the message RAM, T0 to T3") {
  StartedRig rig;
  for (const char* frame : {"642#4011640100000000", "742#R1", "1ABCDEF0#1122334455667788"})
    CHECK(rig.send(frame));
  CHECK(rig.model.ram.read(0x278) == 0x19080000);  // 642h << 18
  CHECK(rig.model.ram.read(0x2C0) == 0x3D080000);  // RTR
  CHECK(rig.model.ram.read(0x308) == 0x5ABCDEF0);  // XTD
}

TEST_CASE("transmit: a request that waits for the end of a scan is not taken for one that has ended") {
  StartedRig rig;
  rig.model.scans = true;
  CHECK(rig.send("601#"));
  CHECK_FALSE(rig.send("602#"));
  rig.poll();
  CHECK(rig.can.counters().taken_back + rig.can.counters().sent == 0);
  rig.model.end_scan();
  CHECK(rig.sent() == "601#");
  CHECK(rig.send("602#"));
}

TEST_CASE("transmit: what waits behind a stale frame is discarded with it; then the bus stays dominant") {
  StartedRig rig;
  CHECK((rig.send("601#") && rig.send("602#")));
  rig.poll();
  CHECK(rig.poll(kSecond) == rig.now);  // off the bus no interrupt wakes the loop
  rig.let_it_ask();
  CHECK(rig.can.state() == BusState::kActive);
  rig.poll(3600 * kSecond);
  CHECK(rig.can.state() == BusState::kBusOff);
  CHECK_FALSE(rig.can.stopped());
  rig.model.recessive(11);
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);
  CHECK(rig.can.counters().taken_back == 2);
  CHECK(rig.sent().empty());
}

TEST_CASE("transmit: if INIT does not answer when a frame is stale, the controller is abandoned") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.poll();
  rig.model.init_refused = true;
  rig.poll(kSecond);
  rig.poll(199 * kMillisecond);
  CHECK_FALSE(rig.can.stopped());
  rig.poll(kMillisecond);
  CHECK(rig.can.stopped());
}

TEST_CASE("errors: a message RAM that does not respond takes the controller off the bus, and back") {
  StartedRig rig;
  rig.model.restricted = true;
  rig.poll();
  CHECK(rig.can.state() == BusState::kBusOff);
  rig.let_it_ask();
  rig.model.recessive(11);
  rig.poll();
  CHECK(rig.can.state() == BusState::kActive);
}

TEST_CASE("STM32H7: registers place the parts of the message RAM where those of the STM32G4 are") {
  FdCanModel model(true);
  boards::stm32::FdCan<SharedRegisters, fdcan::kH7> can{SharedRegisters(model), SharedRegisters(model.ram)};
  REQUIRE(can.init(80'000'000, 500'000, 0x7F, 0));
  for (int i = 0; i < 5; ++i)
    can.poll(0);
  std::vector<std::uint32_t> words;
  for (const std::uint32_t offset : {0x054u, 0x080u, 0x084u, 0x0A0u, 0x0B0u, 0x0BCu, 0x0C0u, 0x0C8u})
    words.push_back(model.read(offset));
  // IE; GFC; SIDFC: 6 filters; RXF0C, RXF1C: 3 places; RXESC: 64 bytes; TXBC: 3 places; TXESC.
  CHECK(words == std::vector{0x02800099u, 0x29u, 0x60000u, 0x300B0u, 0x30188u, 0x77u, 0x3000278u, 7u});
  model.recessive(11);
  can.poll(1);
  for (const char* text : {"081#01", "582#02", "083#03", "084#", "085#"})
    CHECK(model.arrive(frame_from(text)));
  can.on_interrupt();
  CHECK_FALSE(model.line());
  Frame frame;
  for (const char* text : {"582#02", "081#01", "083#03"})
    CHECK((can.receive(frame) && frame == frame_from(text)));
  CHECK(can.counters().overruns == 1);
  CHECK(can.try_send(frame_from("601#01")));
  CHECK(model.sent() == frame_from("601#01"));
}

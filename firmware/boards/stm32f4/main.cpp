// SPDX-License-Identifier: MIT
// The coprocessor on an STM32F446: what board.hpp and settings.hpp say, put together.

#include "boards/common/cortex_m.hpp"
#include "boards/stm32f4/board.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;
using stm32f4::kBoardSettings;
using stm32f4::kNetworks;
using stm32f4::kStationSettings;

static_assert(
    bit_timing(stm32f4::kHseClocks.apb1, kBoardSettings.can_bit_rate, stm32f4::bxcan::kMostPrescaler),
    "settings.hpp: can_bit_rate is none that 40 MHz gives: 10k, 20k, 50k, 100k, 125k, 250k, 500k, 800k, 1M");
static_assert(kBoardSettings.baud >= 1'221 && kBoardSettings.baud <= 500'000,
              "settings.hpp: baud must be within 1221..500000: the bus of 80 MHz gives no less, that of 16 "
              "MHz no more");
static_assert(kBoardSettings.response_delay_us <= 50 * kMillisecond,
              "settings.hpp: response_delay_us is at most 50,000");

constexpr std::uintptr_t kVectorTableOffset = 0xE000ED08;  // VTOR (ARM DDI 0403, B3.2.5)

stm32f4::Board board(kBoardSettings);
Station<kNetworks> station(board, {&board.can()}, kStationSettings);

template <void (stm32f4::Board::*kMember)()>
void interrupt() {
  (board.*kMember)();
}

constexpr VectorTable<stm32f4::kInterrupts> table() {
  VectorTable<stm32f4::kInterrupts> vectors;
  vectors.nmi = interrupt<&stm32f4::Board::on_nmi>;
  vectors.interrupts.fill(fault_handler);
  vectors.interrupts[stm32f4::kCan1Rx0Interrupt] = interrupt<&stm32f4::Board::on_can_received>;
  vectors.interrupts[stm32f4::kCan1Rx1Interrupt] = interrupt<&stm32f4::Board::on_can_received>;
  vectors.interrupts[stm32f4::kCan1SceInterrupt] = interrupt<&stm32f4::Board::on_can_error>;
  vectors.interrupts[stm32f4::kTim2Interrupt] = interrupt<&stm32f4::Board::on_timer>;
  vectors.interrupts[stm32f4::kUsart1Interrupt] = interrupt<&stm32f4::Board::on_modbus>;
  vectors.interrupts[stm32f4::kUsart2Interrupt] = interrupt<&stm32f4::Board::on_modbus>;
  return vectors;
}

[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable<stm32f4::kInterrupts> vectors = table();

}  // namespace

/// The PLC sees it: uptime begins again, the reset's cause is software, which nothing else here does.
void cbcan::boards::on_fault(const Fault& /*fault*/) {
  system_reset();
}

int main() {
  // Where a boot loader started the program, something else is at address 0.
  Mmio(kVectorTableOffset).write(0, reinterpret_cast<std::uintptr_t>(&vectors));
  board.start(station.modbus(), kStationSettings.coprocessors[0].node_id);
  station.start();
  for (;;)
    board.sleep_until(station.turn());
}

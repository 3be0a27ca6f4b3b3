// SPDX-License-Identifier: MIT
// The coprocessor on an MPS2 with AN385: what board.hpp says, put together. A fault is reported by
// semihosting (common/report_fault.cpp).

#include "boards/common/cortex_m.hpp"
#include "boards/mps2_an385/board.hpp"
#include "boards/mps2_an385/reset_note.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;

constexpr mps2::Board::Settings kBoardSettings{115'200, 115'200, 500};
// A gap for an emulator on a loaded PC, yet below what clients wait for an answer; on the bench t3.5 is 1750.
// 1750.
constexpr Station::Settings kSettings{1, 250'000, {}};

[[gnu::section(".registers")]] std::uint16_t registers[regmap::kRegisterFileWords];

mps2::Board board(kBoardSettings, mps2::take_reset_cause());
Station station(registers, board, board.can(), kSettings);

template <void (mps2::Board::*kMember)()>
void interrupt() {
  (board.*kMember)();
}

constexpr VectorTable<32> table() {
  VectorTable<32> vectors;
  vectors.nmi = mps2::on_watchdog;
  vectors.interrupts.fill(fault_handler);
  vectors.interrupts[0] = interrupt<&mps2::Board::on_modbus_received>;
  vectors.interrupts[1] = interrupt<&mps2::Board::on_modbus_sent>;
  vectors.interrupts[2] = interrupt<&mps2::Board::on_adapter_received>;
  vectors.interrupts[3] = interrupt<&mps2::Board::on_adapter_sent>;
  vectors.interrupts[8] = interrupt<&mps2::Board::on_timer>;
  return vectors;
}

[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable<32> vectors = table();

}  // namespace

int main() {
  board.start(station.modbus());
  station.start();
  for (;;)
    board.sleep_until(station.turn());
}

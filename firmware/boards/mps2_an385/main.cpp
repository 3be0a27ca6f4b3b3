// SPDX-License-Identifier: MIT
// The coprocessor on an MPS2 with AN385: what board.hpp says, put together. A fault is reported by
// semihosting (common/report_fault.cpp).

#include "boards/mps2_an385/board.hpp"
#include "boards/mps2_an385/reset_note.hpp"
#include "boards/mps2_an385/vectors.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;

constexpr std::size_t kNetworks = 1;  // the adapter on UART1
constexpr mps2::Board::Settings kBoardSettings{115'200, 115'200, 500};
// The gap is for an emulator on a loaded PC, yet below what clients wait for an answer; t3.5 would be 1750.
constexpr Station<kNetworks>::Settings kSettings{1, 250'000, {}};

[[gnu::section(".registers")]] std::uint16_t registers[kNetworks * regmap::kRegisterFileWords];

mps2::Board board(kBoardSettings, mps2::take_reset_cause());
Station<kNetworks> station(registers, board, {&board.can()}, kSettings);

mps2::Board& the_board() {
  return board;
}

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<the_board>();

}  // namespace

int main() {
  board.start(station.modbus());
  station.start();
  for (;;)
    board.sleep_until(station.turn());
}

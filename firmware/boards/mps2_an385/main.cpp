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
// The gap is for an emulator on a loaded PC, yet below what clients wait for an answer; on a bench leave it
// out.
constexpr Station<kNetworks>::Settings kSettings{
    .modbus = {.silence_us = rtu_silence_us(kBoardSettings.modbus_baud, 10), .gap_us = 250'000},
    .coprocessors = {}};

mps2::Board board(kBoardSettings, mps2::take_reset_cause());
Station<kNetworks> station(board, {&board.can()}, kSettings);

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

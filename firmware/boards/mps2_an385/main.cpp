// SPDX-License-Identifier: MIT
// The coprocessor on an MPS2 with AN385: board.hpp with settings.hpp. A fault is reported by semihosting
// (common/report_fault.cpp).

#include "boards/mps2_an385/board.hpp"
#include "boards/mps2_an385/settings.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;
using mps2::kBoardSettings;
using mps2::kNetworks;
using mps2::kStationSettings;

mps2::Board board(kBoardSettings, mps2::take_reset_cause());
Station<kNetworks> station(board, {&board.can()}, kStationSettings);

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<board>();

}  // namespace

int main() {
  board.start(station.modbus());
  station.start();
  for (;;)
    board.sleep_until(station.turn());
}

// SPDX-License-Identifier: MIT
// The coprocessor on an MPS2 with AN385: board.hpp with settings.hpp. A fault is reported by semihosting
// (common/report_fault.cpp).

#include "boards/mps2_an385/board.hpp"
#include "boards/mps2_an385/settings.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;

mps2::ModbusBoard board(mps2::kBoardSettings, mps2::take_reset_cause());
Station<> station(board, {&board.can()}, mps2::kStationSettings);

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<board>();

}  // namespace

int main() {
  board.start(station.modbus());
  station.start();
  for (;;)
    board.sleep_until(station.turn());
}

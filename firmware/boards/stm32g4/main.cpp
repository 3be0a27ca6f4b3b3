// SPDX-License-Identifier: MIT
// The coprocessor on an STM32G474: board.hpp with settings.hpp.

#include "boards/stm32/board.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;
using stm32::kBoardSettings;

stm32::Board board(kBoardSettings);
stm32::TheStation station(board, {&board.can()}, stm32::station_settings(kBoardSettings, {}));

[[gnu::section(".vectors"), gnu::used]] constinit const auto vectors = stm32::vectors_of<board>();

}  // namespace

int main() {
  stm32::run(board, station, &vectors, nullptr);
}

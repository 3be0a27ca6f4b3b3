// SPDX-License-Identifier: MIT
// The coprocessor on a Raspberry Pi Pico: board.hpp with settings.hpp.

#include "boards/common/parameter_store.hpp"
#include "boards/pico/board.hpp"
#include "boards/pico/flash_memory.hpp"
#include "boards/pico/settings.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;

pico::FlashMemory flash;
std::array<std::uint16_t, 0> no_settings;
ParameterStore store(flash, no_settings, [](std::span<const std::uint16_t> /*words*/) { return true; });
pico::Board board;
Station<1> station(board, {&board.can()}, pico::kStationSettings);

[[gnu::section(".vectors"), gnu::used]] constinit const pico::Vectors vectors = pico::vectors_of<board>();

}  // namespace

int main() {
  store.start(false);
  board.start(&station.modbus(), pico::kModbusBaud);
  board.can().init(pico::kCanCrystal, pico::kCanBitRate, board.now());
  station.keep_in(store);
  station.start();
  for (;;)
    board.sleep_until(station.turn());
}

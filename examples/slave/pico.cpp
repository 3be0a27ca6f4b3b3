// SPDX-License-Identifier: MIT
// The slave on a Raspberry Pi Pico: node 42h, with a store for its parameters and its address.
#include "boards/common/parameter_store.hpp"
#include "boards/pico/board.hpp"
#include "boards/pico/flash_memory.hpp"
#include "module.hpp"

namespace {

using namespace cbcan::boards;

pico::Board board;
Terminals terminals{0x5A, {1234, -2}};  // instead of pins
Module module(board.can(), terminals);
pico::FlashMemory flash;
constexpr std::uint32_t kCrystal = 8'000'000;
std::array<std::uint16_t, 2> address = {500, 0x42};  // kbit/s, node ID
ParameterStore store(
    flash, address,
    [](std::span<const std::uint16_t> some) {
      return Mcp2515<pico::CanSpi>::timing(kCrystal, some[0] * 1000u).has_value();
    },
    module);

[[gnu::section(".vectors"), gnu::used]] constinit const pico::Vectors vectors = pico::vectors_of<board>();

}  // namespace

int main() {
  store.start(false);
  board.start();
  board.can().init(kCrystal, address[0] * 1000u, board.now());
  module.keep_in(store);
  module.start(static_cast<std::uint8_t>(address[1]), board.now());
  run(board, module);
}

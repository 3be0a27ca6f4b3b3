// SPDX-License-Identifier: MIT
// The coprocessor on an STM32F446: board.hpp with settings.hpp.

#include "boards/common/parameter_store.hpp"
#include "boards/stm32/board.hpp"
#include "boards/stm32f4/flash_memory.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;
using stm32::kBoardSettings;

stm32::FlashMemory<Mmio> flash(Mmio(stm32::kFlashBase), Mmio(stm32::kStoreBase),
                               reinterpret_cast<const std::uint32_t*>(stm32::kStoreBase));
stm32::Words words = stm32::words_of(kBoardSettings);
ParameterStore store(flash, words, [](std::span<const std::uint16_t> some) {
  return stm32::settings_of(some).has_value();
});

/// Without those in flash while the blue button of a Nucleo, which pulls PC13 down, is held.
const stm32::Settings settings = [] {
  constexpr std::uint32_t kPortC = 1u << 2;
  stm32::Rcc<Mmio>(Mmio(stm32::kRccBase), Mmio(stm32::kFlashBase)).enable(kPortC, 0, 0);
  store.start(!stm32::Gpio<Mmio>(Mmio(stm32::kPortsBase + 0x800)).read(13));
  return stm32::settings_of(words).value_or(kBoardSettings);
}();
stm32::Board board(settings);
stm32::TheStation station(board, {&board.can()}, stm32::station_settings(settings, words));

[[gnu::section(".vectors"), gnu::used]] constinit const auto vectors = stm32::vectors_of<board>();

}  // namespace

int main() {
  stm32::run(board, station, &vectors, &store);
}

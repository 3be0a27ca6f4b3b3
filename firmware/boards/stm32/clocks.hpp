// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace cbcan::boards::stm32 {

/// Frequencies in Hz. `timers`: TIM2..TIM7, twice APB1 if that is divided.
struct Clocks {
  std::uint32_t apb1;
  std::uint32_t apb2;
  std::uint32_t timers;
};

/// The RC oscillator, as after a reset: 1 % off at 25 C, more over temperature.
inline constexpr Clocks kHsiClocks{16'000'000, 16'000'000, 16'000'000};

}  // namespace cbcan::boards::stm32

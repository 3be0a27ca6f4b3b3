// SPDX-License-Identifier: MIT
#pragma once

/// One Cortex-A53 of a Zynq UltraScale+, in the on-chip memory.
/// Source: UG1085, chapters "System Addresses" and "Interrupts".

#include <cstdint>

#include "boards/common/cortex_a53.hpp"

namespace cbcan::boards {

inline constexpr std::uintptr_t kCan0 = 0xFF060000;
inline constexpr std::uintptr_t kCan1 = 0xFF070000;

/// Interrupt IDs: 32 + the number of the shared peripheral interrupt.
inline constexpr std::uint32_t kCan0Interrupt = 32 + 23;
inline constexpr std::uint32_t kCan1Interrupt = 32 + 24;

}  // namespace cbcan::boards

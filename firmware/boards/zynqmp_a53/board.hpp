// SPDX-License-Identifier: MIT
#pragma once

/// One Cortex-A53 of a Zynq UltraScale+, at EL1: what an image needs besides its drivers.
/// Source: UG1085, chapters "System Addresses" and "Interrupts"; Arm GICv2 (IHI 0048B); Arm ARM (DDI 0487).
///
/// An image has a main() and an on_interrupt(). It lies in the on-chip memory (zynqmp_a53.ld). What main()
/// returns is the exit code of the emulator.

#include <cstdint>

#include "boards/common/registers.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards {

inline constexpr std::uintptr_t kCan0 = 0xFF060000;
inline constexpr std::uintptr_t kCan1 = 0xFF070000;

/// Interrupt IDs: 32 + the number of the shared peripheral interrupt.
inline constexpr std::uint32_t kCan0Interrupt = 32 + 23;
inline constexpr std::uint32_t kCan1Interrupt = 32 + 24;

/// The image's: an enabled interrupt has come. Interrupts are off until it returns.
void on_interrupt(std::uint32_t id);

/// Lets interrupts in; before that none comes, whatever is enabled.
void start_interrupts();

/// One interrupt ID, 32..1019, for this processor.
void enable_interrupt(std::uint32_t id);
void disable_interrupt(std::uint32_t id);

/// The system counter (CNTVCT_EL0), which never goes back.
Time now();

}  // namespace cbcan::boards

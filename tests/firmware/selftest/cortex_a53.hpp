// SPDX-License-Identifier: MIT
#pragma once

/// One emulated Cortex-A53 at EL1 with a GICv2, as far as the self-test needs it: interrupts, a clock, words
/// to the emulator. Source: Arm GICv2 (IHI 0048B); Arm ARM (DDI 0487).

#include <cstdint>

#include "cbcan/time.hpp"

namespace cbcan::test {

/// The test's: an enabled interrupt has come. Interrupts are off until it returns.
void on_interrupt(std::uint32_t id);

/// Lets interrupts in; before that none comes, whatever is enabled.
void start_interrupts();

/// One interrupt ID, 32..1019, for this processor.
void enable_interrupt(std::uint32_t id);
void disable_interrupt(std::uint32_t id);

/// The system counter (CNTVCT_EL0), which never goes back.
Time now();

}  // namespace cbcan::test

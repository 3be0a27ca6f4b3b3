// SPDX-License-Identifier: MIT
#pragma once

/// The functions that the self-test needs of an emulated Cortex-A53 at EL1 with a GICv2: interrupts, a clock, output
/// to the emulator. Source: Arm GICv2 (IHI 0048B); Arm ARM (DDI 0487).

#include <cstdint>

#include "cbcan/time.hpp"

namespace cbcan::test {

/// Defined by the test: an enabled interrupt has occurred. Interrupts are off until it returns.
void on_interrupt(std::uint32_t id);

/// Unmasks interrupts; before that none is handled, whatever is enabled.
void start_interrupts();

/// Enables interrupt `id`, 32..1019, for this processor.
void enable_interrupt(std::uint32_t id);
void disable_interrupt(std::uint32_t id);

/// The system counter (CNTVCT_EL0), which is monotonic.
Time now();

}  // namespace cbcan::test

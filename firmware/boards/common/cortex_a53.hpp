// SPDX-License-Identifier: MIT
#pragma once

/// One Cortex-A53 at EL1 with a GICv2: what its boards have in common.
/// Source: Arm GICv2 (IHI 0048B); Arm ARM (DDI 0487).
///
/// An image has a main() and an on_interrupt(); its board has a kMemoryMap, and a linker script that sets the
/// region RAM and includes cortex_a53.ld. What main() returns is the exit code of the emulator.

#include <cstdint>
#include <span>

#include "cbcan/time.hpp"

namespace cbcan::boards {

struct MemoryMap {
  std::uintptr_t distributor;              ///< of the GIC
  std::uintptr_t processor;                ///< its interface to this processor
  std::span<const std::uint64_t> devices;  ///< 2 MB of Device memory from each of these
};
/// The board's.
extern const MemoryMap kMemoryMap;

/// The image's: an enabled interrupt has come. Interrupts are off until it returns.
void on_interrupt(std::uint32_t id);

/// Lets interrupts in; before that none comes, whatever is enabled.
void start_interrupts();

/// One interrupt ID, 32..1019, for this processor.
void enable_interrupt(std::uint32_t id);
void disable_interrupt(std::uint32_t id);

/// The system counter (CNTVCT_EL0), which never goes back.
Time now();

/// Switches the MMU and the caches on (DDI 0487, D8): RAM is Normal memory, which exclusive accesses need,
/// kMemoryMap.devices is Device memory; there is nothing else, so a null pointer and a stack that runs over
/// fault. Once, before main(); the caches are invalid as the boot loader left them.
void enable_mmu();

}  // namespace cbcan::boards

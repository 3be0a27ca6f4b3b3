// SPDX-License-Identifier: MIT
#pragma once

/// The two CAN controllers of QEMU's xlnx-zcu102. Source: UG1085, chapters "System Addresses" and
/// "Interrupts".

#include <array>
#include <cstdint>

#include "boards/drivers/zynqmp_can.hpp"

namespace cbcan::test {

/// Distributor of the GIC, and its interface to the processor.
inline constexpr std::uintptr_t kDistributor = 0xF901'0000, kProcessorInterface = 0xF902'0000;

using Can = boards::ZynqmpCan<boards::Mmio>;
inline constexpr std::array kControllers{boards::Mmio(0xFF06'0000), boards::Mmio(0xFF07'0000)};
inline constexpr std::array kInterrupts{32u + 23, 32u + 24};
inline constexpr std::uint32_t kClock = 24'000'000;
/// Capacity of the receive FIFO in frames with one byte.
inline constexpr unsigned kFifoFrames = 64;
inline constexpr std::array kKeptOut{0x600u, 0x67Eu, 0x680u, 0x6FFu, 0x780u, 0x7FFu};

/// Prepares the start of the controllers.
inline bool prepare() {
  return true;
}

}  // namespace cbcan::test

// SPDX-License-Identifier: MIT
#pragma once

/// The two CAN controllers of QEMU's xlnx-zcu102.

#include <array>

#include "boards/common/registers.hpp"
#include "boards/zynqmp_a53/board.hpp"
#include "boards/zynqmp_a53/zynqmp_can.hpp"

namespace cbcan::test {

using Can = boards::ZynqmpCan<boards::Mmio>;
inline constexpr std::array kControllers{boards::Mmio(boards::kCan0), boards::Mmio(boards::kCan1)};
inline constexpr std::array kInterrupts{boards::kCan0Interrupt, boards::kCan1Interrupt};
inline constexpr std::uint32_t kClock = 24'000'000;
/// Frames with one byte that the receive FIFO has room for.
inline constexpr unsigned kFifoFrames = 64;
inline constexpr std::array kKeptOut{0x600u, 0x67Eu, 0x680u, 0x6FFu, 0x780u, 0x7FFu};

/// What the controllers need before they start.
inline bool prepare() {
  return true;
}

}  // namespace cbcan::test

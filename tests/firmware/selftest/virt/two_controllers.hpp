// SPDX-License-Identifier: MIT
#pragma once

/// Two kvaser_pci cards, each with an SJA1000, on QEMU's virt.

#include <array>

#include "boards/common/sja1000.hpp"
#include "boards/virt_a53/board.hpp"

namespace cbcan::test {

/// QEMU's SJA1000 keeps data of remote frames, which have none, in its receive FIFO and does not release
/// them: after one with a DLC of 1 all that follow are shifted by a byte. So they leave with DLC 0 here.
struct Registers : boards::MmioBytes {
  using MmioBytes::MmioBytes;
  void write(std::uint32_t offset, std::uint32_t value) const {
    const bool remote = offset == boards::sja1000::BUFFER && (value & boards::sja1000::INFO_RTR) != 0;
    MmioBytes::write(offset, remote ? value & ~boards::sja1000::INFO_DLC : value);
  }
};

using Can = boards::Sja1000<Registers>;
inline constexpr std::array kControllers{Registers(boards::can_of(1)), Registers(boards::can_of(2))};
inline constexpr std::array kInterrupts{boards::interrupt_of(1), boards::interrupt_of(2)};
inline constexpr std::uint32_t kClock = boards::kCanClock;
/// Frames with one byte that the receive FIFO has room for: 64 bytes, four for each.
inline constexpr unsigned kFifoFrames = 16;
inline constexpr std::array kKeptOut{0x600u, 0x67Eu, 0x780u, 0x7FFu};

/// What the controllers need before they start.
inline bool prepare() {
  return boards::start_card(1) && boards::start_card(2);
}

}  // namespace cbcan::test

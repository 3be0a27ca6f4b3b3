// SPDX-License-Identifier: MIT
#pragma once

/// QEMU's board `virt` with `highmem=off`, one Cortex-A53, and two PCI cards `kvaser_pci` in slots 1 and 2,
/// each with an SJA1000. Addresses are those of QEMU 7.2, hw/arm/virt.c and hw/net/can/can_kvaser_pci.c;
/// there is no such hardware.

#include <cstdint>

#include "boards/common/cortex_a53.hpp"

namespace cbcan::boards {

/// 8-bit registers in memory, a byte each.
class MmioBytes {
 public:
  constexpr explicit MmioBytes(std::uintptr_t base) : base_(base) {}

  std::uint32_t read(std::uint32_t offset) const { return *address(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const {
    *address(offset) = static_cast<std::uint8_t>(value);
  }

 private:
  volatile std::uint8_t* address(std::uint32_t offset) const {
    return reinterpret_cast<volatile std::uint8_t*>(base_ + offset);
  }

  std::uintptr_t base_;
};

/// PCI's I/O ports; those of the card in `slot`, 1 or 2, after start_card(), and of its SJA1000 in them.
inline constexpr std::uintptr_t kPorts = 0x3EFF'0000;
constexpr std::uint32_t ports_of(std::uint32_t slot) {
  return slot * 0x1000;
}
inline constexpr std::uint32_t kSja1000Ports = 0x80;

/// Where that SJA1000 is, and the card's interrupt ID.
constexpr std::uintptr_t can_of(std::uint32_t slot) {
  return kPorts + ports_of(slot) + kSja1000Ports;
}
constexpr std::uint32_t interrupt_of(std::uint32_t slot) {
  return 32 + 3 + slot % 4;
}

/// Of the cards' SJA1000: half of their 16 MHz (Linux, drivers/net/can/sja1000/kvaser_pci.c).
inline constexpr std::uint32_t kCanClock = 8'000'000;

/// Gives the card in `slot`, 1 or 2, its addresses and lets its interrupt through. False: it is not there.
bool start_card(std::uint32_t slot);

}  // namespace cbcan::boards

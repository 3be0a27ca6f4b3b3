// SPDX-License-Identifier: MIT
#pragma once

/// Two kvaser_pci cards in slots 1 and 2, each with an SJA1000, on QEMU's board `virt` with `highmem=off`.
/// Addresses are those of QEMU 7.2, hw/arm/virt.c and hw/net/can/can_kvaser_pci.c.

#include <array>
#include <cstdint>

#include "boards/common/registers.hpp"
#include "boards/drivers/sja1000.hpp"

namespace cbcan::test {

/// Distributor of the GIC, and its interface to the processor.
inline constexpr std::uintptr_t kDistributor = 0x0800'0000, kProcessorInterface = 0x0801'0000;

/// Registers in memory, a byte each. QEMU's SJA1000 stores data of remote frames, which have none, in its receive
/// FIFO and does not release them: after one with a DLC of 1 all later frames are shifted by a byte. So they are
/// sent with DLC 0 here.
class Registers {
 public:
  constexpr explicit Registers(std::uintptr_t base) : base_(base) {}

  std::uint32_t read(std::uint32_t offset) const { return *address(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const {
    const bool remote = offset == boards::sja1000::BUFFER && (value & boards::sja1000::INFO_RTR) != 0;
    *address(offset) = static_cast<std::uint8_t>(remote ? value & ~boards::sja1000::INFO_DLC : value);
  }

 private:
  volatile std::uint8_t* address(std::uint32_t offset) const {
    return reinterpret_cast<volatile std::uint8_t*>(base_ + offset);
  }

  std::uintptr_t base_;
};

/// PCI's I/O ports; those of a card after start_card(), and of its SJA1000.
inline constexpr std::uintptr_t kPorts = 0x3EFF'0000;
inline constexpr std::uint32_t kCardPorts = 0x1000;
inline constexpr std::uint32_t kSja1000Ports = 0x80;

using Can = boards::Sja1000<Registers>;
inline constexpr std::array kControllers{Registers(kPorts + kCardPorts + kSja1000Ports),
                                         Registers(kPorts + 2 * kCardPorts + kSja1000Ports)};
inline constexpr std::array kInterrupts{36u, 37u};  // 32 + 3 + slot
/// Half of the cards' 16 MHz (Linux, drivers/net/can/sja1000/kvaser_pci.c).
inline constexpr std::uint32_t kClock = 8'000'000;
/// Capacity of the receive FIFO in frames with one byte: 64 bytes, four for each.
inline constexpr unsigned kFifoFrames = 16;
inline constexpr std::array kKeptOut{0x600u, 0x67Eu, 0x780u, 0x7FFu};

/// Sets the card's addresses and enables its interrupt (PCI Local Bus Specification 3.0, 6.1; S5920). False: there
/// is no card.
inline bool start_card(std::uint32_t slot) {
  const boards::Mmio card(0x3F00'0000 + (slot << 15));  // ECAM: 32 KB for each slot
  if (card.read(0x00) != 0x8406'10E8) return false;
  const std::uint32_t ports = slot * kCardPorts;
  card.write(0x10, ports);                             // BAR0: S5920, the PCI controller
  card.write(0x14, ports + kSja1000Ports);             // BAR1
  card.write(0x18, ports + 0x100);                     // BAR2: Xilinx, not used
  card.write(0x04, 1);                                 // command: I/O enable
  boards::Mmio(kPorts + ports).write(0x38, 1u << 13);  // INTCSR
  return true;
}

/// Prepares the start of the controllers.
inline bool prepare() {
  return start_card(1) && start_card(2);
}

}  // namespace cbcan::test

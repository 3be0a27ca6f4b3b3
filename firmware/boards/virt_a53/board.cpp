// SPDX-License-Identifier: MIT
#include "boards/virt_a53/board.hpp"

#include <array>

#include "boards/common/registers.hpp"

namespace cbcan::boards {

namespace {

constexpr std::uintptr_t kConfiguration = 0x3F00'0000;  // ECAM: 32 KB for each slot
constexpr std::array<std::uint64_t, 3> kDevices{0x0800'0000, 0x3EE0'0000, 0x3F00'0000};  // GIC; the two above

// Configuration space (PCI Local Bus Specification 3.0, 6.1).
constexpr std::uint32_t kIdentity = 0x00;
constexpr std::uint32_t kCommand = 0x04;
constexpr std::uint32_t kBar0 = 0x10;  // S5920, the PCI controller
constexpr std::uint32_t kBar1 = 0x14;  // SJA1000
constexpr std::uint32_t kBar2 = 0x18;  // Xilinx, of which nothing is needed
constexpr std::uint32_t kIoEnable = 1;
constexpr std::uint32_t kCard = 0x8406'10E8;

// S5920.
constexpr std::uint32_t kIntcsr = 0x38;
constexpr std::uint32_t kAddOnInterrupt = 1u << 13;

}  // namespace

constinit const MemoryMap kMemoryMap{0x0800'0000, 0x0801'0000, kDevices};

bool start_card(std::uint32_t slot) {
  const Mmio card(kConfiguration + (slot << 15));
  if (card.read(kIdentity) != kCard) return false;
  const std::uint32_t ports = ports_of(slot);
  card.write(kBar0, ports);
  card.write(kBar1, ports + kSja1000Ports);
  card.write(kBar2, ports + 0x100);
  card.write(kCommand, kIoEnable);
  Mmio(kPorts + ports).write(kIntcsr, kAddOnInterrupt);
  return true;
}

}  // namespace cbcan::boards

// SPDX-License-Identifier: MIT
#include "boards/zynqmp_a53/board.hpp"

#include <array>

namespace cbcan::boards {

namespace {
constexpr std::array<std::uint64_t, 2> kDevices{0xF9000000, 0xFF000000};  // GIC; UARTs, CAN
}

constinit const MemoryMap kMemoryMap{0xF9010000, 0xF9020000, kDevices};

}  // namespace cbcan::boards

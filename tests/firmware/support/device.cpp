// SPDX-License-Identifier: MIT
#include "support/device.hpp"

namespace cbcan::test {

namespace {

using Flags = ObjectFlags;

constexpr std::array kEntries{
    ObjectEntry{0x1017, 0, 0, DataType::kUnsigned16, 0, Flags::kReadWrite | Flags::kChecked, 0, 2},
    ObjectEntry{0x2000, 0, 0, DataType::kUnsigned32, 0, Flags::kReadWrite, 4, 4},
    ObjectEntry{0x2001, 0, 0, DataType::kVisibleString, 0, Flags::kReadWrite | Flags::kVariable, 12, 32},
    ObjectEntry{0x2002, 0, 0, DataType::kDomain, 0, Flags::kReadWrite, 48, 128},
    ObjectEntry{0x2003, 0, 0, DataType::kUnsigned16, 0, Flags::kRead, 176, 2},
};

}  // namespace

Device::Device(std::uint8_t node_id, CanPort& port, std::uint16_t heartbeat_ms)
    : slave(node_id, {kEntries, values_, {}}, buffer_, *this, port), heartbeat_ms_(heartbeat_ms) {}

/// Power-on: 2000h = 12345678h, everything else except 1017h 0 or empty.
void Device::restore(std::uint16_t first_index, std::uint16_t last_index, Time /*now*/) {
  static constexpr std::array<std::uint8_t, 192> kPowerOn{0, 0, 0, 0, 0x78, 0x56, 0x34, 0x12};
  restore_values(kEntries, kPowerOn, values_, first_index, last_index);
  slave.dictionary().set(0x1017, 0, heartbeat_ms_);
  ++resets;
}

}  // namespace cbcan::test

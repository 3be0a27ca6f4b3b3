// SPDX-License-Identifier: MIT
#include "coprocessor/local_objects.hpp"

#include <string_view>

#include "canopen/nmt.hpp"
#include "cbcan/version.hpp"

namespace cbcan::local {

namespace {

using enum DataType;
using Flags = ObjectFlags;

constexpr std::uint8_t kAll = nmt::kMaxNode;
constexpr std::uint8_t kComputedRead = Flags::kRead | Flags::kComputed;
constexpr std::uint8_t kComputedReadWrite = Flags::kReadWrite | Flags::kComputed;
constexpr std::uint8_t kConfigured = Flags::kReadWrite | Flags::kChecked;

constexpr std::string_view kName = "cbcan coprocessor";
constexpr std::string_view kHardware = "1.0";
constexpr std::string_view kSoftware = kVersion;

/// A row of the dictionary with its power-on value; where the value goes is computed below.
struct Row {
  std::uint16_t index;
  std::uint8_t first_sub;
  std::uint8_t last_sub;
  DataType type;
  std::uint8_t flags;
  std::uint32_t size;
  std::uint32_t value = 0;
  std::string_view text = {};
};

constexpr std::uint32_t length(std::string_view text) {
  return static_cast<std::uint32_t>(text.size());
}

constexpr std::array kRows{
    Row{kDeviceType, 0, 0, kUnsigned32, Flags::kRead, 4, 0},  // no device profile
    Row{kErrorRegister, 0, 0, kUnsigned8, Flags::kRead, 1, 0},
    Row{kSyncCobId, 0, 0, kUnsigned32, kConfigured, 4, 0x80},
    Row{kSyncPeriod, 0, 0, kUnsigned32, kConfigured, 4, 0},
    Row{kDeviceName, 0, 0, kVisibleString, Flags::kRead | Flags::kVariable, length(kName), 0, kName},
    Row{kHardwareVersion, 0, 0, kVisibleString, Flags::kRead | Flags::kVariable, length(kHardware), 0,
        kHardware},
    Row{kSoftwareVersion, 0, 0, kVisibleString, Flags::kRead | Flags::kVariable, length(kSoftware), 0,
        kSoftware},
    Row{kConsumerHeartbeat, 0, 0, kUnsigned8, Flags::kRead, 1, kAll},
    Row{kConsumerHeartbeat, 1, kAll, kUnsigned32, kComputedReadWrite, 4},
    Row{kProducerHeartbeat, 0, 0, kUnsigned16, kConfigured, 2, 0},
    Row{kIdentity, 0, 0, kUnsigned8, Flags::kRead, 1, 4},
    Row{kIdentity, 1, 4, kUnsigned32, Flags::kRead, 4, 0},  // no vendor-ID is assigned
    Row{kSdoServerParameter, 0, 0, kUnsigned8, Flags::kRead, 1, 2},
    Row{kSdoServerParameter, 1, 2, kUnsigned32, kComputedRead, 4},
    Row{kOwnNodeId, 0, 0, kUnsigned8, kComputedRead, 1},
    Row{kKernelState, 0, 0, kUnsigned8, kComputedRead, 1},
    Row{kSdoTimeout, 0, 0, kUnsigned16, kComputedReadWrite, 2},
    Row{kTransferMode, 0, 0, kUnsigned8, kComputedReadWrite, 1},
    Row{kDeviceState, 0, 0, kUnsigned8, Flags::kRead, 1, kAll},
    Row{kDeviceState, 1, kAll, kUnsigned8, kComputedRead, 1},
};

constexpr auto kEntries = [] {
  std::array<ObjectEntry, kRows.size()> entries{};
  std::uint32_t offset = 0;
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    const Row& row = kRows[i];
    ObjectEntry& entry = entries[i];
    entry = {row.index, row.first_sub, row.last_sub, row.type, row.flags, 0, row.size};
    entry.offset = offset + entry.front();
    if (!entry.has(Flags::kComputed)) offset += entry.stride() * (row.last_sub - row.first_sub + 1u);
  }
  return entries;
}();

constexpr void put(LocalValues& values, std::uint32_t at, std::uint32_t number, std::uint32_t bytes) {
  for (std::uint32_t i = 0; i < bytes; ++i)
    values[at + i] = static_cast<std::uint8_t>(number >> 8 * i);
}

/// Does not compile when kValueBytes is too small.
constexpr LocalValues kPowerOn = [] {
  LocalValues values{};
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    const Row& row = kRows[i];
    if ((row.flags & Flags::kComputed) != 0) continue;
    const ObjectEntry& entry = kEntries[i];
    if (!row.text.empty()) {
      put(values, entry.offset - entry.front(), length(row.text), entry.front());
      for (std::size_t c = 0; c < row.text.size(); ++c)
        values[entry.offset + c] = static_cast<std::uint8_t>(row.text[c]);
      continue;
    }
    for (unsigned sub = row.first_sub; sub <= row.last_sub; ++sub)
      put(values, entry.offset + entry.stride() * (sub - row.first_sub), row.value, row.size);
  }
  return values;
}();

}  // namespace

std::span<const ObjectEntry> entries() {
  return kEntries;
}

void restore(LocalValues& values, std::uint16_t first_index, std::uint16_t last_index) {
  restore_values(kEntries, kPowerOn, values, first_index, last_index);
}

}  // namespace cbcan::local

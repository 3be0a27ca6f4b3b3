// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/local_objects.hpp"

#include "cbcan/copy_bytes.hpp"

namespace cbcan::local {

namespace {

constexpr std::array<ObjectEntry, table::kRows.size()> kEntries = table::kLayout.entries;

using PowerOn = std::array<std::uint8_t, table::kLayout.power_on_bytes>;

constexpr void put(PowerOn& values, std::uint32_t at, std::uint32_t number, std::uint32_t bytes) {
  for (std::uint32_t i = 0; i < bytes; ++i)
    values[at + i] = static_cast<std::uint8_t>(number >> 8 * i);
}

constexpr PowerOn kPowerOn = [] {
  PowerOn values{};
  for (std::size_t i = 0; i < table::kRows.size(); ++i) {
    const table::Row& row = table::kRows[i];
    const ObjectEntry& entry = kEntries[i];
    if (!row.stored() || row.zero()) continue;
    if (!row.text.empty()) {
      put(values, entry.offset - entry.front(), static_cast<std::uint32_t>(row.text.size()), entry.front());
      for (std::size_t c = 0; c < row.text.size(); ++c)
        values[entry.offset + c] = static_cast<std::uint8_t>(row.text[c]);
      continue;
    }
    for (std::uint32_t k = 0; k < entry.count(); ++k)
      put(values, entry.offset + entry.stride() * k, row.value, entry.capacity);
  }
  return values;
}();

}  // namespace

std::span<const ObjectEntry> entries() {
  return kEntries;
}

void restore(LocalValues& values, std::uint16_t first_index, std::uint16_t last_index) {
  if (first_index == 0) {
    values.fill(0);
    return copy_bytes(kPowerOn.data(), values.data(), kPowerOn.size());
  }
  restore_values(kEntries, kPowerOn, values, first_index, last_index);
}

bool is_power_on(std::size_t offset, std::span<const std::uint8_t> bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [&offset](std::uint8_t byte) {
    const std::size_t at = offset++;
    return byte == (at < kPowerOn.size() ? kPowerOn[at] : 0);
  });
}

}  // namespace cbcan::local

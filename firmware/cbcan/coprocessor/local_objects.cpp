// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/local_objects.hpp"

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/copy_bytes.hpp"

namespace cbcan::local {

namespace {

constexpr std::array<ObjectEntry, table::kRows.size()> kEntries = table::kLayout.entries;

using PowerOn = std::array<std::uint8_t, table::kLayout.power_on_bytes>;

constexpr PowerOn kPowerOn = [] {
  PowerOn values{};
  const auto put = [&values](std::uint32_t at, std::uint32_t bytes, std::uint64_t number) {
    store_little_endian(std::span(values).subspan(at, bytes), number);
  };
  for (std::size_t i = 0; i < table::kRows.size(); ++i) {
    const table::Row& row = table::kRows[i];
    const ObjectEntry& entry = kEntries[i];
    if (!row.stored() || row.zero()) continue;
    if (!row.text.empty()) {
      put(entry.offset - entry.front(), entry.front(), row.text.size());
      std::ranges::copy(row.text, &values[entry.offset]);
      continue;
    }
    for (std::uint32_t k = 0; k < entry.count(); ++k)
      put(entry.offset + entry.stride() * k, entry.capacity, row.value);
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

// SPDX-License-Identifier: MIT
#pragma once

/// Object dictionaries of tests, as tables.

#include <cstdint>
#include <vector>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::test {

/// One or more identical sub-indices, and their power-on value.
struct ObjectRow {
  std::uint16_t index;
  std::uint8_t first_sub;
  std::uint8_t last_sub;
  DataType type;
  std::uint64_t value = 0;
  std::uint16_t flags = ObjectFlags::kReadWrite;
  bool follows_node_id = false;  ///< `value` is for node ID 0
  std::uint32_t capacity = 0;    ///< of zeros of variable length, at first `value` of them

  /// Its values begin at 0.
  ObjectEntry entry(std::uint16_t more_flags = 0) const {
    const auto all_flags = static_cast<std::uint16_t>(flags | more_flags);
    const auto fixed = static_cast<std::uint32_t>(size_of(type));
    return {index, first_sub, last_sub, type, 0, all_flags, 0, capacity != 0 ? capacity : fixed};
  }
};

/// Values follow each other in the order of the rows. `more`: flags of all of them.
inline std::vector<ObjectEntry> entries_of(const std::vector<ObjectRow>& rows, std::uint16_t more = 0) {
  std::vector<ObjectEntry> entries;
  std::uint32_t end = 0;
  for (const ObjectRow& row : rows) {
    ObjectEntry& entry = entries.emplace_back(row.entry(more));
    entry.offset = end + entry.front();
    end += entry.stride() * entry.subs();
  }
  return entries;
}

inline std::vector<std::uint8_t> values_of(const std::vector<ObjectRow>& rows, std::uint8_t node_id = 0) {
  std::vector<std::uint8_t> values;
  for (const ObjectRow& row : rows)
    for (std::uint32_t sub = 0; sub < row.entry().subs(); ++sub) {
      std::uint64_t value = row.value + (row.follows_node_id ? node_id : 0u);
      for (std::uint32_t byte = 0; byte < row.entry().stride(); ++byte, value >>= 8)
        values.push_back(static_cast<std::uint8_t>(value));
    }
  return values;
}

}  // namespace cbcan::test

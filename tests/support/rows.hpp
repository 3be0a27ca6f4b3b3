// SPDX-License-Identifier: MIT
#pragma once

/// Object dictionaries of tests, as tables.

#include <cstdint>
#include <vector>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::test {

/// One or more identical sub-indices, and their power-on value.
struct Row {
  std::uint16_t index;
  std::uint8_t first_sub;
  std::uint8_t last_sub;
  DataType type;
  std::uint64_t value = 0;
  std::uint16_t flags = ObjectFlags::kReadWrite;
  bool follows_node_id = false;  ///< `value` is for node ID 0
};

/// Values follow each other in the order of the rows. `more`: flags of all of them.
inline std::vector<ObjectEntry> entries_of(const std::vector<Row>& rows, std::uint16_t more = 0) {
  std::vector<ObjectEntry> entries;
  std::uint32_t offset = 0;
  for (const Row& row : rows) {
    const auto size = static_cast<std::uint32_t>(size_of(row.type));
    entries.push_back({row.index, row.first_sub, row.last_sub, row.type, 0,
                       static_cast<std::uint16_t>(row.flags | more), offset, size});
    offset += size * (row.last_sub - row.first_sub + 1u);
  }
  return entries;
}

inline std::vector<std::uint8_t> values_of(const std::vector<Row>& rows, std::uint8_t node_id = 0) {
  std::vector<std::uint8_t> values;
  for (const Row& row : rows)
    for (unsigned sub = row.first_sub; sub <= row.last_sub; ++sub)
      for (std::size_t byte = 0; byte < size_of(row.type); ++byte) {
        const std::uint64_t value = row.value + (row.follows_node_id ? node_id : 0u);
        values.push_back(static_cast<std::uint8_t>(value >> 8 * byte));
      }
  return values;
}

}  // namespace cbcan::test

// SPDX-License-Identifier: MIT
#pragma once

/// Values that depend on the node ID, such as a device's default COB-IDs (CiA 301, 7.3.5; $NODEID in an EDS).
/// A device whose node ID can be changed by LSS keeps a list of them.

#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan {

/// A number in a dictionary's values that is a constant plus `factor` times the node ID.
struct NodeIdValue {
  std::uint32_t offset;  ///< into the values
  std::uint32_t factor;  ///< 1 in all files that conform to CiA 306
  std::uint8_t size;     ///< bytes, 1..8
};

/// Converts values for node ID `from` into those for node ID `to`; 0 = no node ID. Apply it to the power-on
/// values; resets then copy them. Numbers that do not fit wrap.
inline void change_node_id(std::span<std::uint8_t> values, std::span<const NodeIdValue> list,
                           std::uint8_t from, std::uint8_t to) {
  const std::uint64_t difference = std::uint64_t{to} - from;
  for (const NodeIdValue& relative : list) {
    const std::span<std::uint8_t> number = values.subspan(relative.offset, relative.size);
    store_little_endian(number, load_little_endian(number) + relative.factor * difference);
  }
}

}  // namespace cbcan

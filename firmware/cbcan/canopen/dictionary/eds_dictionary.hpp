// SPDX-License-Identifier: MIT
#pragma once

/// An object dictionary that cbcan-eds has made from an EDS file; all of it is constant.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/node_id_values.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan {

/// An object by its name in the EDS file.
struct ObjectAddress {
  std::uint16_t index;
  std::uint8_t sub;
};

struct EdsDictionary {
  std::span<const ObjectEntry> entries;
  std::span<const ObjectLimits> limits;
  std::span<const std::uint8_t> power_on;       ///< for node ID 0; values after its end are 0
  std::span<const NodeIdValue> node_id_values;  ///< those of the communication area first
  std::size_t communication_node_id_values;
  // The memory that it needs.
  std::size_t value_bytes;
  std::size_t largest_value;  ///< bytes
  std::size_t rpdos;
  std::size_t tpdos;
  std::size_t objects_of_pdo;
  std::size_t watched_nodes;
};

}  // namespace cbcan

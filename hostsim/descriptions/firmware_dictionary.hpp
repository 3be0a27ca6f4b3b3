// SPDX-License-Identifier: MIT
#pragma once

/// Makes the constant tables of firmware (cbcan::EdsDictionary) from a dictionary image: alike sub-indices
/// and alike indices become one entry, a constant sub-index 0 a flag, and values that are 0 need no flash.

#include <cstdint>
#include <vector>

#include "descriptions/dictionary_image.hpp"

namespace cbcan::descriptions {

struct FirmwareDictionary {
  std::vector<ObjectEntry> entries;
  std::vector<ObjectLimits> limits;
  std::vector<std::uint8_t> power_on;  ///< for node ID 0; the values after its end are 0
  std::vector<NodeIdValue> node_id_values;
  std::size_t communication_node_id_values = 0;  ///< the first of them
  std::size_t value_bytes = 0;
  DeviceMemory memory;
};

/// `image`: for node ID 0.
FirmwareDictionary firmware_dictionary(DictionaryImage image);

}  // namespace cbcan::descriptions

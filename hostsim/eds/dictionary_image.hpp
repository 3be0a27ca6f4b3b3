// SPDX-License-Identifier: MIT
#pragma once

/// From a device description to what ObjectDictionary works on.

#include <cstdint>
#include <vector>

#include "cbcan/canopen/dictionary/node_id_values.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "eds/device_description.hpp"

namespace cbcan::eds {

/// Keep it, unchanged in size, as long as a dictionary works on it. `values` as built are the values after
/// power-on: copy them to have the defaults for a reset.
struct DictionaryImage {
  std::vector<ObjectEntry> entries;  ///< sorted by index, then sub; no overlap
  std::vector<ObjectLimits>
      limits;  ///< sorted by index, then sub; only where a limit is narrower than the type
  std::vector<std::uint8_t>
      values;  ///< every entry's value behind the one before; a variable one with its length
  /// Values that $NODEID is part of, by offset: change_node_id() makes them those of another node. Limits
  /// stay as they are.
  std::vector<NodeIdValue> node_id_values;
};

/// Entry for entry what is in `device.objects`, without those below 1000h (data types, which SDO does not
/// reach) and without behaviour: no entry is kComputed or kChecked.
DictionaryImage dictionary_image(const DeviceDescription& device);

/// What access, PDO mapping and a missing value of an object come to. rwr maps into TPDOs only, rww into
/// RPDOs only (CiA 306, 4.6.3).
std::uint16_t object_flags(const Object& object);

}  // namespace cbcan::eds

// SPDX-License-Identifier: MIT
#pragma once

/// From a device description to the data of an ObjectDictionary.

#include <cstdint>
#include <vector>

#include "cbcan/canopen/dictionary/node_id_values.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "eds/device_description.hpp"

namespace cbcan::eds {

/// Must live, with unchanged sizes, as long as the dictionary that uses it. At first `values` are those after
/// power-on: copy them to have the defaults for a reset.
struct DictionaryImage {
  std::vector<ObjectEntry> entries;  ///< sorted by index, then sub; no overlap
  std::vector<ObjectLimits>
      limits;  ///< sorted by index, then sub; only where a limit is narrower than the type
  std::vector<std::uint8_t>
      values;  ///< the values of all entries in order; one of variable length has its length in front
  /// Values that contain $NODEID, by offset: change_node_id() changes them for another node. Limits stay.
  std::vector<NodeIdValue> node_id_values;
};

/// One entry for each of `device.objects`, except those below 1000h (data types, which SDO cannot access). No
/// entry is kComputed or kChecked.
DictionaryImage dictionary_image(const DeviceDescription& device);

}  // namespace cbcan::eds

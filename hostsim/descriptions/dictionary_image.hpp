// SPDX-License-Identifier: MIT
#pragma once

/// Makes the data of an ObjectDictionary from a device description.

#include <cstdint>
#include <string_view>
#include <vector>

#include "cbcan/canopen/dictionary/node_id_values.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "descriptions/device_description.hpp"

namespace cbcan::descriptions {

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

/// Read for any node ID, the text gives objects that differ by values only; false also if that is not
/// certain. `objects`: for node ID 0.
bool only_values_differ(std::string_view text, const std::vector<Object>& objects);

/// The same for a Device: every write goes through on_write(), and what is written to 1003h, 1010h and 1011h
/// is a command.
DictionaryImage prepared(DictionaryImage image);

/// Objects that are mapped into PDOs at the start are taken for process data. `dictionary`: of these entries.
void mark_mapped(std::vector<ObjectEntry>& entries, const ObjectDictionary& dictionary);

/// The memory that a Device with these entries needs.
struct DeviceMemory {
  std::size_t largest_value = 0;  ///< bytes
  std::size_t rpdos = 0;
  std::size_t tpdos = 0;
  std::size_t objects_of_pdo = 0;  ///< most that a mapping has room for
  std::size_t watched_nodes = 0;   ///< 1016h
};
DeviceMemory memory_of(const std::vector<ObjectEntry>& entries);

/// 1600h and so on.
bool is_mapping(std::uint16_t index);

}  // namespace cbcan::descriptions

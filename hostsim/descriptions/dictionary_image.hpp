// SPDX-License-Identifier: MIT
#pragma once

/// Makes the data of an ObjectDictionary from a device description, and firmware's C++ header with the same.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/canopen/dictionary/node_id_values.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/program_download.hpp"
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
/// is a command. With 1F50h, a DOMAIN that can only be written, 1F50h is streamed, and 1F51h, 1F56h and 1F57h
/// are computed (cbcan/canopen/program_download.hpp).
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

/// The constant tables of firmware (cbcan::EdsDictionary): alike sub-indices and alike indices are one entry,
/// a constant sub-index 0 is a flag, and values that are 0 need no flash.
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

/// A device's EDS or DCF file as a C++ header for firmware: cbcan::EdsDictionary, and the names of its
/// objects. Defines `space::kDictionary` and `space::od`. Throws UsageError, "io.eds:12: ...", for a mistake
/// in the file or something that the stack does not have; `remarks`: other mistakes, and what is used
/// instead.
std::string dictionary_header(std::string_view text, const std::string& name, const std::string& space,
                              std::vector<std::string>& remarks);

}  // namespace cbcan::descriptions

// SPDX-License-Identifier: MIT
#pragma once

/// A device's EDS or DCF file as a C++ header for firmware: cbcan::EdsDictionary, and the names of its
/// objects.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "descriptions/dictionary_image.hpp"

namespace cbcan::descriptions {

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

/// Defines `space::kDictionary` and `space::od`. Throws UsageError, "io.eds:12: ...", for a mistake in the
/// file or something that the stack does not have; `remarks`: other mistakes, and what is used instead.
std::string dictionary_header(std::string_view text, const std::string& name, const std::string& space,
                              std::vector<std::string>& remarks);

}  // namespace cbcan::descriptions

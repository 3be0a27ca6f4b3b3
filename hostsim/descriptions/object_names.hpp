// SPDX-License-Identifier: MIT
#pragma once

/// The names of objects in an EDS, for display.

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "descriptions/device_description.hpp"

namespace cbcan::descriptions {

struct ObjectName {
  std::uint16_t index;
  std::uint8_t first_sub;
  std::uint8_t last_sub;
  DataType type;
  std::string name;  ///< UTF-8
};

/// Sorted by index, then sub.
using ObjectNames = std::vector<ObjectName>;

inline ObjectNames object_names(const DeviceDescription& device) {
  ObjectNames names;
  for (const Object& object : device.objects)
    names.push_back({object.index, object.first_sub, object.last_sub, object.type, object.name});
  return names;
}

/// Null if there is none.
inline const ObjectName* find_name(const ObjectNames& names, std::uint16_t index, std::uint8_t sub) {
  const auto key = [](const ObjectName& name) { return name.index << 8 | name.last_sub; };
  const auto found = std::ranges::lower_bound(names, index << 8 | sub, {}, key);
  return found != names.end() && found->index == index && found->first_sub <= sub ? &*found : nullptr;
}

}  // namespace cbcan::descriptions

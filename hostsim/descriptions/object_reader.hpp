// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "descriptions/device_description.hpp"
#include "descriptions/object_sections.hpp"
#include "descriptions/value_reader.hpp"

namespace cbcan::descriptions {

/// Makes objects from their sections (CiA 306, 4.6). `all`: ascending by index. The result is sorted by index,
/// then sub; `count`: about how many there will be.
std::vector<Object> read_objects(const std::vector<ObjectSections>& all, std::size_t count, ValueReader& values,
                                 StandardType standard_type, Findings& findings);

}  // namespace cbcan::descriptions

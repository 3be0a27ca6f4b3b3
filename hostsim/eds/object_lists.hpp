// SPDX-License-Identifier: MIT
#pragma once

/// [MandatoryObjects], [OptionalObjects] and [ManufacturerObjects] (CiA 306, 4.6.1) against the sections
/// there are. The lists make no objects; where they lie, that is said.

#include <vector>

#include "eds/object_sections.hpp"
#include "eds/value_reader.hpp"

namespace cbcan::eds {

void check_object_lists(const std::vector<Section>& sections, const std::vector<ObjectSections>& objects,
                        ValueReader& values, Findings& findings);

}  // namespace cbcan::eds

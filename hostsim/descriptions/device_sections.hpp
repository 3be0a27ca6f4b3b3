// SPDX-License-Identifier: MIT
#pragma once

/// The sections that are not about objects, as far as they matter here: the node ID of a DCF, the lists of
/// objects (CiA 306, 4.6.1), and what is described there but not simulated.

#include <cstdint>
#include <optional>
#include <vector>

#include "descriptions/object_sections.hpp"
#include "descriptions/value_reader.hpp"

namespace cbcan::descriptions {

/// NodeID of [DeviceComissioning], spelled like this in CiA 306, 5.2; nullopt for an EDS.
std::optional<std::uint8_t> read_node_id(const std::vector<Section>& sections, Findings& findings);

/// Reports listed objects without a section, modules, and CompactPDO: none of them is simulated.
void report_left_out(const std::vector<Section>& sections, const std::vector<ObjectSections>& objects,
                     ValueReader& values, Findings& findings);

}  // namespace cbcan::descriptions

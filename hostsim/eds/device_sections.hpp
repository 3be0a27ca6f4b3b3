// SPDX-License-Identifier: MIT
#pragma once

/// The sections that are not about objects: [DeviceInfo], [DeviceComissioning], and those about modules.

#include <optional>
#include <string_view>
#include <vector>

#include "eds/device_description.hpp"
#include "eds/value_reader.hpp"

namespace cbcan::eds {

/// The first section of this name, whatever its case; null if there is none. Further ones are reported.
const Section* find_section(const std::vector<Section>& sections, std::string_view name, Findings& findings);

DeviceInfo read_device_info(const std::vector<Section>& sections, ValueReader& values, Findings& findings);

/// Nothing for an EDS. Says so if the file was made for another node than `node_id`.
std::optional<Commissioning> read_commissioning(const std::vector<Section>& sections,
                                                std::optional<std::uint8_t> node_id, Findings& findings);

/// Says that modules are not read, if the file has any.
void report_modules(const std::vector<Section>& sections, ValueReader& values, Findings& findings);

}  // namespace cbcan::eds

// SPDX-License-Identifier: MIT
#include "descriptions/device_sections.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "base/numbers.hpp"
#include "base/words.hpp"
#include "descriptions/diagnostics.hpp"

namespace cbcan::descriptions {

namespace {

/// The first section of this name, in any case of letters; null if there is none. Further ones are reported.
const Section* find_section(const std::vector<Section>& sections, std::string_view name, Findings& findings) {
  const Section* first = nullptr;
  for (const Section& section : sections) {
    if (!base::same_text(section.name, name)) continue;
    if (first == nullptr) {
      first = &section;
    } else {
      findings.warning(section.line, bracketed(section.name) + " is here again: the one in line " +
                                         std::to_string(first->line) + " is used");
    }
  }
  return first;
}

/// Reports `message` if `key` has a number above 0.
void report_key(const std::vector<Section>& sections, std::string_view name, const Key& key,
                std::string_view message, ValueReader& values, Findings& findings) {
  const Section* const section = find_section(sections, name, findings);
  if (section != nullptr && values.number(*section, key, 0xFFFF).value_or(0) > 0)
    findings.warning(section->find(key)->line, std::string(message));
}

void report_missing(const Section& list, const std::vector<ObjectSections>& objects, ValueReader& values,
                    Findings& findings) {
  for (const KeyValue& entry : list.entries) {
    if (!parse_count(entry.key) || entry.value.empty()) continue;
    const auto index = values.pattern(entry, DataType::kUnsigned16);
    if (!index) continue;
    const auto found = std::ranges::lower_bound(objects, index->bits, {}, &ObjectSections::index);
    if (found != objects.end() && found->index == index->bits && found->has_values()) continue;
    const std::string name = base::hex(index->bits, 4);
    findings.error(entry.line, "object " + name + "h is listed, but there is no [" + name + "]: left out");
  }
}

}  // namespace

std::optional<std::uint8_t> read_node_id(const std::vector<Section>& sections, Findings& findings) {
  const Section* section = find_section(sections, "DeviceComissioning", findings);
  if (section == nullptr) section = find_section(sections, "DeviceCommissioning", findings);
  if (section == nullptr) return std::nullopt;
  const auto node_id = ValueReader(findings, std::nullopt).number(*section, "NodeID", 127, 1);
  return node_id ? std::optional(static_cast<std::uint8_t>(*node_id)) : std::nullopt;
}

void report_left_out(const std::vector<Section>& sections, const std::vector<ObjectSections>& objects,
                     ValueReader& values, Findings& findings) {
  for (const std::string_view name : {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"})
    if (const Section* const list = find_section(sections, name, findings))
      report_missing(*list, objects, values, findings);
  report_key(sections, "DeviceInfo", "CompactPDO",
             "CompactPDO: PDOs without sections of their own are not made", values, findings);
  report_key(sections, "SupportedModules", "NrOfEntries",
             "the file describes modules: what they would add is not used", values, findings);
}

}  // namespace cbcan::descriptions

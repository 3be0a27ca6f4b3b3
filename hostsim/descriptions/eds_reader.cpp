// SPDX-License-Identifier: MIT
#include "descriptions/eds_reader.hpp"

#include <algorithm>
#include <array>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "descriptions/modules.hpp"
#include "descriptions/object_sections.hpp"

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
      findings.warning(section.line, "{} is here again: the one in line {} is used", bracketed(section.name),
                       first->line);
    }
  }
  return first;
}

constexpr unsigned kPdoArea = 0x400;  ///< indices of all parameters and mappings of RPDOs, or of TPDOs

/// Reports PDOs that [DeviceInfo] counts and that have no sections, if CompactPDO is above 0: these are not
/// made.
void report_compact_pdos(const Section& info, const std::vector<ObjectSections>& objects, ValueReader& values,
                         Findings& findings) {
  if (values.number(info, "CompactPDO", 0xFFFF).value_or(0) == 0) return;
  for (const auto& [key, first] : {std::pair(Key("NrOfRXPDO"), object::kRpdoParameter),
                                   std::pair(Key("NrOfTXPDO"), object::kTpdoParameter)}) {
    const auto found = std::ranges::count_if(objects, [area = first / kPdoArea](const ObjectSections& each) {
      return each.index / kPdoArea == area && each.has_values();
    });
    const std::uint64_t pdos = values.number(info, key, 0xFFFF).value_or(0);
    if (std::cmp_less(found, 2 * pdos))
      findings.warning(info.find(key)->line,
                       "{} is {}, but the file has not all their objects: those of CompactPDO are not made",
                       key.text(), pdos);
  }
}

void report_missing(const Section& list, const std::vector<ObjectSections>& objects, ValueReader& values,
                    Findings& findings) {
  for (const KeyValue& entry : list.entries) {
    if (!parse_count(entry.key) || entry.value.empty()) continue;
    const auto index = values.pattern(entry, DataType::kUnsigned16);
    if (!index) continue;
    const auto found = std::ranges::lower_bound(objects, index->bits, {}, &ObjectSections::index);
    if (found != objects.end() && found->index == index->bits && found->has_values()) continue;
    findings.warning(entry.line, "object {0:04X}h is listed, but there is no [{0:04X}]: left out",
                     index->bits);
  }
}

/// NodeID of [DeviceComissioning], spelled like this in CiA 306, 5.2; nullopt for an EDS.
std::optional<std::uint8_t> read_node_id(const std::vector<Section>& sections, Findings& findings) {
  const Section* section = find_section(sections, "DeviceComissioning", findings);
  if (section == nullptr) section = find_section(sections, "DeviceCommissioning", findings);
  if (section == nullptr) return std::nullopt;
  const auto node_id = ValueReader(findings, std::nullopt).number(*section, "NodeID", 127, 1);
  return node_id ? std::optional(static_cast<std::uint8_t>(*node_id)) : std::nullopt;
}

/// Reports listed objects (CiA 306, 4.6.1) without a section, modules that are not connected, and PDOs of
/// CompactPDO: none of them is simulated.
void report_left_out(const std::vector<Section>& sections, const std::vector<ObjectSections>& objects,
                     ValueReader& values, Findings& findings) {
  for (const std::string_view name : kObjectLists)
    if (const Section* const list = find_section(sections, name, findings))
      report_missing(*list, objects, values, findings);
  if (const Section* const info = find_section(sections, "DeviceInfo", findings))
    report_compact_pdos(*info, objects, values, findings);
  const Section* const modules = find_section(sections, "SupportedModules", findings);
  if (modules != nullptr && values.number(*modules, "NrOfEntries", 0xFFFF).value_or(0) > 0)
    findings.warning(modules->find("NrOfEntries")->line,
                     "the file describes modules, but none is connected");
}

constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";
constexpr std::array<std::string_view, 2> kUtf16Marks = {"\xFF\xFE", "\xFE\xFF"};

/// The text without a byte order mark; empty if it is in a form that cannot be read.
std::string_view readable(std::string_view text, Findings& findings) {
  if (text.starts_with(kUtf8Mark)) text.remove_prefix(kUtf8Mark.size());
  for (const std::string_view mark : kUtf16Marks) {
    if (!text.starts_with(mark)) continue;
    findings.error(1, "this is UTF-16: save the file as ASCII or UTF-8");
    return {};
  }
  for (const std::string_view start : {"<?xml", "<ISO15745ProfileContainer"}) {
    if (!base::trim(text).starts_with(start)) continue;
    findings.error(1,
                   "an XML device description (CiA 311); export it as EDS, for example with CANopenEditor");
    return {};
  }
  return text;
}

}  // namespace

const Object* DeviceDescription::find(std::uint16_t index, std::uint8_t sub) const {
  const auto found = std::partition_point(objects.begin(), objects.end(), [&](const Object& object) {
    return object.index < index || (object.index == index && object.last_sub < sub);
  });
  const bool is_it = found != objects.end() && found->index == index && found->first_sub <= sub;
  return is_it ? &*found : nullptr;
}

Result read(std::string_view text, const std::string& file_name, std::optional<std::uint8_t> node_id,
            StandardType standard_type, std::span<const std::string> modules) {
  Findings findings(file_name);
  Result result;
  DeviceDescription& device = result.device;
  Sections all = split_sections(readable(text, findings), findings);
  std::vector<Section>& sections = all.list;
  const std::optional<std::uint8_t> own = read_node_id(sections, findings);
  device.node_id = node_id ? node_id : own;
  ValueReader values(findings, device.node_id);
  ModuleTexts made;
  const Section* const connected = find_section(sections, "ConnectedModules", findings);
  if (connect_modules(sections, modules, connected, file_name, values, findings, made))
    result.flat = to_text(sections);
  const std::vector<ObjectSections> objects = collect_objects(sections, findings);
  if (objects.empty())
    findings.error(1, "there is no object in it, no section like [1000]: is this an EDS or DCF?");
  report_left_out(sections, objects, values, findings);
  device.objects = read_objects(objects, sections.size(), values, standard_type, findings);
  result.diagnostics = findings.take();
  return result;
}

}  // namespace cbcan::descriptions

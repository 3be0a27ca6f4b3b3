// SPDX-License-Identifier: MIT
#include "descriptions/eds_reader.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/words.hpp"
#include "descriptions/device_sections.hpp"
#include "descriptions/object_reader.hpp"

namespace cbcan::descriptions {

namespace {

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
  if (cbcan::base::trim(text).starts_with('<')) {
    findings.error(1,
                   "this is XML, perhaps an XDD of CiA 311, which is not read: save it as EDS, as "
                   "CANopenEditor does");
    return {};
  }
  return text;
}

std::vector<Object> read_objects(const std::vector<Section>& sections, ValueReader& values,
                                 StandardType standard_type, Findings& findings) {
  const std::vector<ObjectSections> objects = collect_objects(sections, findings);
  if (objects.empty())
    findings.error(1, "there is no object in it, no section like [1000]: is this an EDS or DCF?");
  report_left_out(sections, objects, values, findings);
  ObjectReader reader(values, standard_type, findings, sections.size());
  for (const ObjectSections& object : objects)
    reader.read(object);
  return reader.take();
}

}  // namespace

const Object* DeviceDescription::find(std::uint16_t index, std::uint8_t sub) const {
  const auto found = std::partition_point(objects.begin(), objects.end(), [&](const Object& object) {
    return object.index < index || (object.index == index && object.last_sub < sub);
  });
  const bool is_it = found != objects.end() && found->index == index && found->first_sub <= sub;
  return is_it ? &*found : nullptr;
}

Result read(std::string_view text, std::string file_name, std::optional<std::uint8_t> node_id,
            StandardType standard_type) {
  Findings findings(std::move(file_name));
  Result result;
  DeviceDescription& device = result.device;
  const Sections all = split_sections(readable(text, findings), findings);
  const std::vector<Section>& sections = all.list;
  const std::optional<std::uint8_t> own = read_node_id(sections, findings);
  device.node_id = node_id ? node_id : own;
  ValueReader values(findings, device.node_id);
  device.objects = read_objects(sections, values, standard_type, findings);
  result.diagnostics = findings.take();
  return result;
}

}  // namespace cbcan::descriptions

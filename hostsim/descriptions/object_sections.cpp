// SPDX-License-Identifier: MIT
#include "descriptions/object_sections.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"

namespace cbcan::descriptions {

namespace {

constexpr auto kSuffixes = std::to_array<std::pair<std::string_view, Part>>({{"Name", Part::kNames},
                                                                             {"Value", Part::kValues},
                                                                             {"Denotation", Part::kUnused},
                                                                             {"ObjectLinks", Part::kUnused}});

struct Located {
  SectionPlace place;
  const Section* section = nullptr;
};

std::optional<std::uint64_t> parse_index(std::string_view text) {
  text = base::trim(text);
  if (base::has_hex_prefix(text)) text.remove_prefix(2);
  return base::parse<std::uint64_t>(text, 16);
}

/// Where "sub" is in a section name; npos if nowhere.
std::size_t find_sub(std::string_view name) {
  for (std::size_t at = 0; at + 3 <= name.size(); ++at)
    if ((name[at] | 0x20) == 's' && base::same_text(name.substr(at, 3), "sub")) return at;
  return std::string_view::npos;
}

/// A name that can only be a mistyped object; other unknown sections are manufacturer-specific.
bool looks_like_object(std::string_view name) {
  const std::size_t digits = std::min(name.find_first_not_of("0123456789abcdefABCDEF"), name.size());
  return digits > 0 && (name.front() <= '9' || base::same_text(name.substr(digits, 3), "sub"));
}

std::vector<Located> locate(const std::vector<Section>& sections, Findings& findings) {
  std::vector<Located> all;
  for (const Section& section : sections) {
    const std::optional<SectionPlace> place = parse_section_name(section.name);
    if (!place) {
      if (looks_like_object(section.name))
        findings.error(section.line, "{} is no name of a section, [1018] or [1018sub1] would be: left out",
                       bracketed(section.name));
    } else if (place->index == 0 || place->index > 0xFFFF) {
      findings.error(section.line, "{}: an index is 1..FFFFh: left out", bracketed(section.name));
    } else if (place->sub > 0xFF) {
      findings.error(section.line, "{}: a sub-index is 0..FFh: left out", bracketed(section.name));
    } else {
      all.push_back({*place, &section});
    }
  }
  std::ranges::stable_sort(all, {}, &Located::place);
  return all;
}

void put(ObjectSections& object, const Located& located) {
  switch (located.place.part) {
    case Part::kMain: object.main = located.section; break;
    case Part::kSub:
      object.subs.push_back({static_cast<std::uint8_t>(located.place.sub), located.section});
      break;
    case Part::kNames: object.names = located.section; break;
    case Part::kValues: object.values = located.section; break;
    case Part::kUnused: break;
  }
}

/// Longest line in CiA 306, 4.1.
constexpr std::size_t kMostTextBytes = 255;

/// DefaultValue="1x"
std::string key_is(const KeyValue& entry) {
  return shortened(entry.key) + '=' + quoted(entry.value);
}

}  // namespace

std::string object_lists(std::span<const std::uint64_t> indices) {
  const auto list_of = [](std::uint64_t index) -> std::string_view {
    if (index == object::kDeviceType || index == object::kErrorRegister || index == object::kIdentity)
      return kObjectLists[0];
    const bool is_own = index >= object::kFirstManufacturer && index <= object::kLastManufacturer;
    return kObjectLists[is_own ? 2 : 1];
  };
  std::string text;
  for (const std::string_view list : kObjectLists) {
    text += fmt::format("[{}]\nSupportedObjects={}\n", list, std::ranges::count(indices, list, list_of));
    std::size_t number = 0;
    for (const std::uint64_t index : indices)
      if (list_of(index) == list) text += fmt::format("{}=0x{:04X}\n", ++number, index);
    text += "\n";
  }
  return text;
}

std::optional<SectionPlace> parse_section_name(std::string_view name) {
  if (const std::size_t at = find_sub(name); at != std::string_view::npos) {
    const std::optional<std::uint64_t> index = parse_index(name.substr(0, at));
    const std::optional<std::uint64_t> sub = parse_index(name.substr(at + 3));
    return index && sub ? std::optional(SectionPlace{*index, Part::kSub, *sub}) : std::nullopt;
  }
  if (const auto index = parse_index(name)) return SectionPlace{*index, Part::kMain, 0};
  for (const auto& [suffix, part] : kSuffixes) {
    if (name.size() <= suffix.size()) continue;
    const std::size_t at = name.size() - suffix.size();
    if (!base::same_text(name.substr(at), suffix)) continue;
    const std::optional<std::uint64_t> index = parse_index(name.substr(0, at));
    return index ? std::optional(SectionPlace{*index, part, 0}) : std::nullopt;
  }
  return std::nullopt;
}

std::size_t ObjectSections::line() const {
  if (main != nullptr) return main->line;
  if (!subs.empty()) return subs.front().section->line;
  for (const Section* section : {names, values})
    if (section != nullptr) return section->line;
  return 1;
}

std::vector<ObjectSections> collect_objects(const std::vector<Section>& sections, Findings& findings) {
  std::vector<ObjectSections> objects;
  const Located* previous = nullptr;
  const std::vector<Located> all = locate(sections, findings);
  for (const Located& located : all) {
    if (previous != nullptr && previous->place == located.place) {
      findings.warning(located.section->line, "{} is here again: the one in line {} is used",
                       bracketed(located.section->name), previous->section->line);
      continue;
    }
    previous = &located;
    const auto index = static_cast<std::uint16_t>(located.place.index);
    if (objects.empty() || objects.back().index != index) objects.emplace_back().index = index;
    put(objects.back(), located);
  }
  return objects;
}

std::optional<std::uint64_t> ValueReader::number(const Section& section, const Key& key,
                                                 std::uint64_t highest, std::uint64_t lowest) {
  const KeyValue* const entry = section.find(key);
  return entry == nullptr ? std::nullopt : number(*entry, highest, lowest);
}

std::optional<std::uint64_t> ValueReader::number(const KeyValue& entry, std::uint64_t highest,
                                                 std::uint64_t lowest) {
  const std::optional<Number> number = integer(entry);
  if (!number) return std::nullopt;
  if (!number->negative && number->magnitude >= lowest && number->magnitude <= highest)
    return number->magnitude;
  findings_.warning(entry.line, "{} is not within {}..{}: ignored", key_is(entry), lowest, highest);
  return std::nullopt;
}

std::string ValueReader::text(const KeyValue& entry) {
  return base::to_utf8(base::head(entry.value, kMostTextBytes));
}

std::optional<Pattern> ValueReader::pattern(const KeyValue& entry, DataType type) {
  std::optional<std::uint64_t> bits;
  std::uint32_t node_ids = 0;
  if (is_real(type)) {
    bits = parse_real(without_comment(entry), type);
  } else if (const std::optional<Number> number = integer(entry)) {
    bits = to_bits(*number, type);
    node_ids = number->node_ids;
  } else {
    return std::nullopt;
  }
  if (bits) return Pattern{*bits, node_ids};
  findings_.warning(entry.line, "{} is no {}: ignored", key_is(entry), name_of(type));
  return std::nullopt;
}

std::optional<Value> ValueReader::value(const KeyValue& entry, DataType type) {
  if (const std::size_t size = size_of(type); size > 0) {
    const std::optional<Pattern> number = pattern(entry, type);
    return number ? std::optional(Value{to_bytes(number->bits, size), number->node_ids}) : std::nullopt;
  }
  if (type == DataType::kVisibleString) return Value{{entry.value.begin(), entry.value.end()}};
  if (type == DataType::kUnicodeString) return Value{to_utf16(entry.value)};
  std::optional<std::vector<std::uint8_t>> octets = parse_octets(entry.value);
  if (octets) return Value{std::move(*octets)};
  findings_.warning(entry.line, "{} is not pairs of hexadecimal digits: ignored", key_is(entry));
  return std::nullopt;
}

std::optional<Number> ValueReader::integer(const KeyValue& entry) {
  const std::optional<Number> plain = parse_plain(entry.value);
  return plain ? plain : unusual_integer(entry);
}

std::optional<Number> ValueReader::unusual_integer(const KeyValue& entry) {
  std::optional<Number> number = parse_number(entry.value, node_id_.value_or(0));
  if (!number) number = parse_number(without_comment(entry), node_id_.value_or(0));
  if (!number) {
    findings_.warning(entry.line, "{} is no number of up to 64 bits: ignored", key_is(entry));
    return std::nullopt;
  }
  if (number->no_octal)
    findings_.warning(entry.line, "{} starts like an octal number, but is none: read as decimal",
                      key_is(entry));
  if (number->node_ids != 0 && !node_id_ && !missing_node_id_reported_) {
    findings_.warning(entry.line,
                      "$NODEID is used, but there is no node ID: 0 is used, here and further down");
    missing_node_id_reported_ = true;
  }
  return number;
}

std::string_view ValueReader::without_comment(const KeyValue& entry) {
  const std::size_t comment = entry.value.find(';');
  if (comment == std::string_view::npos) return entry.value;
  findings_.warning(entry.line, "{} has a \";\" in it: what follows is ignored", key_is(entry));
  return base::trim(entry.value.substr(0, comment));
}

}  // namespace cbcan::descriptions

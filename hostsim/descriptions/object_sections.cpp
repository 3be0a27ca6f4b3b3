// SPDX-License-Identifier: MIT
#include "descriptions/object_sections.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "base/text.hpp"
#include "descriptions/lexer.hpp"

namespace cbcan::descriptions {

namespace {

enum class Part : std::uint8_t { kMain, kSub, kNames, kValues, kUnused };

constexpr auto kSuffixes = std::to_array<std::pair<std::string_view, Part>>({{"Name", Part::kNames},
                                                                             {"Value", Part::kValues},
                                                                             {"Denotation", Part::kUnused},
                                                                             {"ObjectLinks", Part::kUnused}});

struct Place {
  std::uint64_t index = 0;
  Part part = Part::kMain;
  std::uint64_t sub = 0;
  auto operator<=>(const Place&) const = default;
};

struct Located {
  Place place;
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

std::optional<Place> parse_section_name(std::string_view name) {
  if (const std::size_t at = find_sub(name); at != std::string_view::npos) {
    const std::optional<std::uint64_t> index = parse_index(name.substr(0, at));
    const std::optional<std::uint64_t> sub = parse_index(name.substr(at + 3));
    return index && sub ? std::optional(Place{*index, Part::kSub, *sub}) : std::nullopt;
  }
  if (const auto index = parse_index(name)) return Place{*index, Part::kMain, 0};
  for (const auto& [suffix, part] : kSuffixes) {
    if (name.size() <= suffix.size()) continue;
    const std::size_t at = name.size() - suffix.size();
    if (!base::same_text(name.substr(at), suffix)) continue;
    const std::optional<std::uint64_t> index = parse_index(name.substr(0, at));
    return index ? std::optional(Place{*index, part, 0}) : std::nullopt;
  }
  return std::nullopt;
}

/// A name that can only be a mistyped object; other unknown sections are manufacturer-specific.
bool looks_like_object(std::string_view name) {
  const std::size_t digits = std::min(name.find_first_not_of("0123456789abcdefABCDEF"), name.size());
  return digits > 0 && (name.front() <= '9' || base::same_text(name.substr(digits, 3), "sub"));
}

std::vector<Located> locate(const std::vector<Section>& sections, Findings& findings) {
  std::vector<Located> all;
  for (const Section& section : sections) {
    const std::optional<Place> place = parse_section_name(section.name);
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

}  // namespace

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

}  // namespace cbcan::descriptions

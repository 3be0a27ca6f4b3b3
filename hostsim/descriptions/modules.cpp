// SPDX-License-Identifier: MIT
#include "descriptions/modules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <tuple>

#include "base/error.hpp"
#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/pdo/mapping.hpp"
#include "descriptions/dictionary_image.hpp"

namespace cbcan::descriptions {

namespace {

constexpr std::uint64_t kLastIndex = 0xFFFF;
constexpr std::uint64_t kMostSubs = 254;
constexpr std::uint64_t kIoProfile = 401;

bool is_of_module(const Section& section) {
  const std::string_view name = section.name;
  return name.size() > 1 && (name[0] == 'M' || name[0] == 'm') && name[1] >= '0' && name[1] <= '9';
}

/// Adds the objects of modules, one module after another.
class Connector {
 public:
  Connector(const std::vector<Section>& sections, bool is_configured, ValueReader& values, Findings& findings,
            ModuleTexts& made)
      : is_configured_(is_configured), values_(values), findings_(findings), made_(made) {
    for (const Section& section : sections) {
      const auto place = parse_section_name(section.name);
      if (is_of_module(section))
        parts_.push_back(section);
      else if (place)
        objects_.try_emplace(*place, section);
      else if (!base::same_text(section.name, "SupportedModules") &&
               !base::same_text(section.name, "ConnectedModules"))
        others_.push_back(section);
    }
  }

  void connect(std::uint64_t type) {
    const std::string fixed = fmt::format("M{}Fixed", type), extension = fmt::format("M{}SubExt", type);
    for (const Section& part : parts_) {
      if (const auto place = place_in(part, fixed); place && has_room(part))
        objects_.emplace(*place, part).first->second.name = name_of(*place);
      if (const auto place = place_in(part, extension)) extend(place->index, part);
    }
  }

  std::vector<Section> finish() {
    for (const auto& [index, part] : extended_)
      complete(index, part);
    for (auto at = objects_.begin(); at != objects_.end(); ++at)
      if (at->first.part == Part::kSub && at->first.sub == 0 &&
          is_mapping(static_cast<std::uint16_t>(at->first.index)))
        map(at->first.index);
    for (const auto& [place, section] : objects_)
      others_.push_back(section);
    return std::move(others_);
  }

 private:
  struct Extension {
    std::uint64_t index = 0;  ///< the one that is extended now
    std::uint64_t bits = 0;   ///< used of its last sub-index; 0 = all
    bool is_complete = false;
  };

  /// The object in a name that begins like this.
  static std::optional<SectionPlace> place_in(const Section& part, std::string_view beginning) {
    const bool is_it = base::same_text(part.name.substr(0, beginning.size()), beginning);
    return is_it ? parse_section_name(part.name.substr(beginning.size())) : std::nullopt;
  }

  void extend(std::uint64_t index, const Section& part) {
    const bool has_subs = values_.number(part, "ObjectType", 0xFF).value_or(0) > 7;
    if (has_subs && part.find("DataType") == nullptr) return;  // the heading of [M2SubExt6000sub1]
    const bool is_complete = is_configured_ && highest_sub(index) > 0;
    Extension& to = extensions_.try_emplace(index, Extension{index, 0, is_complete}).first->second;
    if (to.is_complete) return;
    const auto type = static_cast<DataType>(values_.number(part, "DataType", 0xFFFF).value_or(0));
    const std::uint64_t room = 8 * std::max<std::uint64_t>(size_of(type), 1);
    const auto [whole, bits] = count_of(part);
    if (whole > 0) to.bits = 0;
    std::uint64_t count = whole + (to.bits + bits + room - 1) / room - (to.bits + room - 1) / room;
    to.bits = (to.bits + bits) % room;
    while (count > 0 && append(part, to))
      --count;
  }

  /// "2", or "0;4"
  std::pair<std::uint64_t, std::uint64_t> count_of(const Section& part) {
    const KeyValue* const count = part.find("Count");
    if (count == nullptr) return {1, 0};
    KeyValue whole = *count, bits = *count;
    std::tie(whole.value, bits.value) =
        base::split(count->value, ';').value_or(std::pair(count->value, std::string_view("0")));
    return {values_.number(whole, 0xFF).value_or(1), values_.number(bits, 0xFF).value_or(0)};
  }

  /// False if there is no room.
  bool append(const Section& part, Extension& to) {
    const std::uint64_t extend = values_.number(part, "ObjExtend", 0xFF).value_or(0);
    const std::uint64_t most = extend == 0 ? kMostSubs : std::min(extend, kMostSubs);
    for (; highest_sub(to.index) >= most; ++to.index)
      if (extend == 0 || to.index == kLastIndex)
        return fail(part, fmt::format("{:04X}h has no room for sub-indices of more modules", to.index));
    if (!has_room(part)) return false;
    const SectionPlace place{to.index, Part::kSub, highest_sub(to.index) + 1};
    objects_.emplace(place, part).first->second.name = name_of(place);
    extended_.emplace(to.index, part);
    return true;
  }

  bool has_room(const Section& part) {
    for (const KeyValue& entry : part.entries)
      bytes_ += sizeof entry + entry.value.size();
    bytes_ += sizeof part;
    return bytes_ <= kMostModuleBytes || fail(part, "the modules have too many objects");
  }
  /// Always false.
  bool fail(const Section& part, const std::string& what) {
    findings_.error(part.line, "{}: left out", what);
    return false;
  }

  /// The main section of an object that has been extended, and sub-index 0.
  void complete(std::uint64_t index, const Section& by) {
    const SectionPlace main{index}, zero{index, Part::kSub, 0};
    const std::uint64_t last = highest_sub(index);
    if (!objects_.contains(main)) {
      const KeyValue* const name = by.find("ParameterName");
      set(main, by.line, "ParameterName", name == nullptr ? "" : name->value);
      set(main, by.line, "ObjectType", "8");
    }
    set(main, 0, "SubNumber", std::to_string(last + 1));
    if (!objects_.contains(zero)) {
      set(zero, by.line, "ParameterName", "NrOfObjects");
      set(zero, by.line, "DataType", "5");
      set(zero, by.line, "AccessType", "ro");
    }
    set(zero, 0, "DefaultValue", std::to_string(last));
  }

  /// `pdo`: 1600h and so on.
  void map(std::uint64_t pdo) {
    const SectionPlace zero{pdo, Part::kSub, 0};
    const auto entry = [&](std::uint64_t sub) { return number({pdo, Part::kSub, sub}, "DefaultValue"); };
    const std::uint64_t count = entry(0);
    if (objects_.at(zero).find("ParameterValue") != nullptr || count > PdoMapping::kMostObjects) return;
    std::uint64_t there = 0;
    while (there < count && is_there(entry(there + 1)))
      ++there;
    if (there == 0)
      map_as_profile(pdo);
    else if (there < count)
      set(zero, 0, "DefaultValue", std::to_string(there));
  }

  /// `entry`: of a mapping.
  bool is_there(std::uint64_t entry) const {
    const std::uint64_t index = entry >> 16, sub = entry >> 8 & 0xFF;
    const bool is_dummy = index > 0 && index < object::kFirstCommunication;
    return is_dummy || objects_.contains({index, Part::kSub, sub}) ||
           (objects_.contains({index}) && sub <= number({index}, "CompactSubObj"));
  }

  /// CiA 401: the first PDO has eight digital blocks, the next three have four analogue channels each.
  void map_as_profile(std::uint64_t pdo) {
    const bool receive = pdo < object::kTpdoMapping;
    const std::uint64_t place = pdo - (receive ? object::kRpdoMapping : object::kTpdoMapping);
    if (place > 3 || (number({object::kDeviceType}, "DefaultValue") & 0xFFFF) != kIoProfile) return;
    const std::uint64_t index = place == 0 ? (receive ? 0x6200 : 0x6000) : (receive ? 0x6411 : 0x6401);
    const std::uint64_t most = place == 0 ? 8 : 4, before = place == 0 ? 0 : 4 * (place - 1);
    const std::uint64_t last = std::min(highest_sub(index), before + most);
    std::uint64_t count = 0;
    for (; before + count < last && objects_.contains({pdo, Part::kSub, count + 1}); ++count)
      set({pdo, Part::kSub, count + 1}, 0, "DefaultValue",
          "0x" + base::hex(index << 16 | (before + count + 1) << 8 | (place == 0 ? 8 : 16), 8));
    if (count > 0) set({pdo, Part::kSub, 0}, 0, "DefaultValue", std::to_string(count));
  }

  std::uint64_t highest_sub(std::uint64_t index) const {
    const auto after = objects_.lower_bound({index, Part::kNames, 0});
    const bool has_sub = after != objects_.begin() && std::prev(after)->first.index == index;
    return std::max(has_sub ? std::prev(after)->first.sub : 0, number({index}, "CompactSubObj"));
  }
  std::uint64_t number(const SectionPlace& place, const Key& key) const {
    const auto found = objects_.find(place);
    return found == objects_.end() ? 0 : values_.number(found->second, key, ~std::uint64_t{0}).value_or(0);
  }

  /// `line`: of a new section.
  void set(const SectionPlace& place, std::size_t line, const Key& key, std::string_view value) {
    Section& section = objects_.try_emplace(place, Section{name_of(place), line, {}, 0}).first->second;
    auto& entries = made_.entries.emplace_back(section.entries.begin(), section.entries.end());
    auto entry = std::ranges::find_if(entries, [&](const KeyValue& each) { return key.is(each.key); });
    if (entry == entries.end()) entry = entries.insert(entry, {key.text(), {}, section.line, key.hash()});
    entry->value = made_.texts.emplace_back(value);
    section.entries = entries;
    section.seen |= key.bit();
  }
  std::string_view name_of(const SectionPlace& place) {
    const std::string sub = place.part == Part::kSub ? "sub" + base::hex(place.sub, 1) : "";
    return made_.texts.emplace_back(base::hex(place.index, 4) + sub);
  }

  bool is_configured_;
  ValueReader& values_;
  Findings& findings_;
  ModuleTexts& made_;
  std::map<SectionPlace, Section> objects_;
  std::vector<Section> parts_, others_;
  std::map<std::uint64_t, Extension> extensions_;  ///< by the index in the name of the section
  std::map<std::uint64_t, Section> extended_;      ///< the first section that has extended it
  std::size_t bytes_ = 0;
};

/// Names of the types of modules, by their numbers.
using Types = std::map<std::uint64_t, std::string_view>;

Types types_in(const std::vector<Section>& sections) {
  constexpr std::string_view kInfo = "ModuleInfo";
  Types types;
  for (const Section& section : sections) {
    const std::size_t end = section.name.size() - std::min(kInfo.size(), section.name.size());
    if (!is_of_module(section) || !base::same_text(section.name.substr(end), kInfo)) continue;
    const KeyValue* const name = section.find("ProductName");
    if (const auto number = parse_count(section.name.substr(1, end - 1)))
      types.emplace(*number, name == nullptr ? "" : name->value);
  }
  return types;
}

std::uint64_t type_of(std::string_view module, const Types& types, const std::string& file) {
  for (const auto& [number, name] : types)
    if (number == parse_count(module) || base::same_text(name, module)) return number;
  if (types.empty()) throw ModuleError("modules: " + file + " has no [SupportedModules]");
  const std::vector names = base::column(types, &Types::value_type::second);
  throw ModuleError(base::to_utf8(
      fmt::format("modules: '{}' is not a module of {}; modules: {}", module, file, fmt::join(names, ", "))));
}

/// The types in [ConnectedModules].
std::vector<std::uint64_t> connected_in(const Section& list, const Types& types, ValueReader& values,
                                        Findings& findings) {
  using Places = std::map<std::uint64_t, std::uint64_t>;
  Places by_place;
  for (const KeyValue& entry : list.entries) {
    const auto place = entry.value.empty() ? std::nullopt : parse_count(entry.key);
    if (!place) continue;
    const auto type = values.number(entry, 0xFFFF);
    if (type && types.contains(*type) && *place <= kMostModules)
      by_place.emplace(*place, *type);
    else if (type)
      findings.error(entry.line, "there is no [M{}ModuleInfo], or the position is above {}: left out", *type,
                     kMostModules);
  }
  return base::column(by_place, &Places::value_type::second);
}

}  // namespace

bool connect_modules(std::vector<Section>& sections, std::span<const std::string> modules,
                     const Section* connected, const std::string& file, ValueReader& values,
                     Findings& findings, ModuleTexts& made) {
  if (modules.empty() && connected == nullptr) return false;
  const Types types = types_in(sections);
  std::vector<std::uint64_t> chosen;
  for (const std::string& module : modules)
    chosen.push_back(type_of(module, types, file));
  if (modules.empty()) chosen = connected_in(*connected, types, values, findings);
  if (chosen.empty()) return false;
  Connector connector(sections, modules.empty(), values, findings, made);
  for (const std::uint64_t type : chosen)
    connector.connect(type);
  sections = connector.finish();
  return true;
}

std::string to_text(const std::vector<Section>& sections) {
  std::vector<std::uint64_t> indices;
  std::string text;
  for (const Section& section : sections) {
    if (const auto place = parse_section_name(section.name); place && place->part == Part::kMain)
      indices.push_back(place->index);
    if (std::ranges::find(kObjectLists, section.name) != kObjectLists.end()) continue;
    text += fmt::format("[{}]\n", section.name);
    for (const KeyValue& entry : section.entries)
      if (!base::same_text(entry.key, "Count") && !base::same_text(entry.key, "ObjExtend"))
        text += fmt::format("{}={}\n", entry.key, entry.value);
  }
  return text + object_lists(indices);
}

}  // namespace cbcan::descriptions

// SPDX-License-Identifier: MIT
#include "descriptions/object_sections.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "descriptions/eds_reader.hpp"

namespace cbcan::descriptions {

namespace {

constexpr Key kSizeKey = "CBCAN_Size";

/// The last two are not in CiA 306, but occur in files.
constexpr auto kAccessNames =
    std::to_array<std::pair<std::string_view, Access>>({{"ro", Access::kReadOnly},
                                                        {"wo", Access::kWriteOnly},
                                                        {"rw", Access::kReadWrite},
                                                        {"rwr", Access::kReadWriteInput},
                                                        {"rww", Access::kReadWriteOutput},
                                                        {"const", Access::kConstant},
                                                        {"r", Access::kReadOnly},
                                                        {"w", Access::kWriteOnly}});

bool less_than(std::int64_t a, std::int64_t b, DataType type) {
  return is_signed(type) ? a < b : static_cast<std::uint64_t>(a) < static_cast<std::uint64_t>(b);
}

std::int64_t number_in(const Object& object) {
  return from_bits(load_little_endian(object.value), object.type);
}

/// LowLimit and HighLimit are read for these types.
bool has_limits(DataType type) {
  return size_of(type) > 0 && !is_real(type) && type != DataType::kTimeOfDay &&
         type != DataType::kTimeDifference;
}

constexpr std::uint8_t kMostSubs = 254;

/// ARRAY, RECORD and DEFSTRUCT have sub-objects.
constexpr bool is_structure(ObjectType type) {
  return type == ObjectType::kArray || type == ObjectType::kRecord || type == ObjectType::kDefStruct;
}

/// What the section of a sub-object does not contain.
struct Whole {
  std::uint16_t index = 0;
  ObjectType type = ObjectType::kVar;
  std::uint8_t highest_sub = 0;
};

/// Sub-index 0, if the file has none.
Object count_object(const Whole& whole, std::size_t line) {
  Object object;
  object.index = whole.index;
  object.name = "NrOfObjects";
  object.type = DataType::kUnsigned8;
  object.access = Access::kReadOnly;
  object.value = {whole.highest_sub};
  object.has_value = true;
  object.capacity = 1;
  object.line = line;
  return object;
}

class ObjectReader {
 public:
  ObjectReader(std::size_t count, ValueReader& values, StandardType standard_type, Findings& findings)
      : values_(values), standard_type_(standard_type), findings_(findings) {
    objects_.reserve(count);
  }

  void read(const ObjectSections& sections) {
    const std::uint8_t count = compact_count(sections);
    const bool has_subs = count > 0 || !sections.subs.empty();
    if (count == 0) reject_compact_sections(sections);
    if (!sections.has_values()) return;
    const std::uint8_t highest = sections.subs.empty() ? count : std::max(count, sections.subs.back().sub);
    const Whole whole{sections.index, type_of(sections, has_subs), highest};
    if (count > 0) {
      read_compact(sections, whole, count);
    } else if (has_subs) {
      read_subs(sections, whole);
    } else if (is_structure(whole.type)) {
      findings_.error(sections.line(), "{} should have sub-objects, but has none: left out",
                      bracketed(sections.main->name));
    } else if (whole.type != ObjectType::kNull) {
      add(object_of(*sections.main, whole, 0));
    }
  }

  std::vector<Object> take() { return std::move(objects_); }

 private:
  using PerSub = std::array<const KeyValue*, 256>;

  /// The entries of [xxxxName] and [xxxxValue] for single elements; null where there is none.
  struct OwnEntries {
    PerSub names;
    PerSub values;

    bool has(unsigned sub) const { return names[sub] != nullptr || values[sub] != nullptr; }
  };

  std::uint8_t compact_count(const ObjectSections& sections) {
    if (sections.main == nullptr) return 0;
    const auto count = values_.number(*sections.main, "CompactSubObj", 0xFF).value_or(0);
    if (count > kMostSubs)
      findings_.warning(sections.main->find("CompactSubObj")->line,
                        "CompactSubObj is at most 254: 254 is used");
    return static_cast<std::uint8_t>(std::min<std::uint64_t>(count, kMostSubs));
  }

  ObjectType type_of(const ObjectSections& sections, bool has_subs) {
    if (sections.main == nullptr) {
      findings_.warning(sections.line(), "there is no [{:04X}], but sub-objects of it: a RECORD is assumed",
                        sections.index);
      return ObjectType::kRecord;
    }
    const std::optional<ObjectType> type = object_type(*sections.main);
    if (!has_subs || (type && is_structure(*type))) return type.value_or(ObjectType::kVar);
    findings_.warning(sections.line(), "{} has sub-objects, but is no ARRAY or RECORD: a RECORD is assumed",
                      bracketed(sections.main->name));
    return ObjectType::kRecord;
  }

  void read_subs(const ObjectSections& sections, const Whole& whole) {
    if (sections.subs.front().sub != 0) {
      findings_.warning(sections.line(),
                        "{:04X}h has no sub-index 0: a read-only one that says {} is assumed", whole.index,
                        whole.highest_sub);
      add(count_object(whole, sections.line()));
    }
    for (const SubSection& sub : sections.subs)
      add(object_of(*sub.section, whole, sub.sub));
  }

  void read_compact(const ObjectSections& sections, const Whole& whole, std::uint8_t count) {
    const OwnEntries own{entries_per_sub(sections.names, count), entries_per_sub(sections.values, count)};
    const Object element = object_of(*sections.main, whole, 1);
    auto next = sections.subs.begin();
    if (next == sections.subs.end() || next->sub != 0) add(count_object(whole, sections.line()));

    std::optional<Object> run;
    const auto end_run = [&] {
      if (run) add(*std::exchange(run, std::nullopt));
    };
    for (unsigned sub = 0; sub <= whole.highest_sub; ++sub) {
      if (next != sections.subs.end() && next->sub == sub) {
        end_run();
        add(object_of(*next->section, whole, next->sub));
        ++next;
      } else if (sub > 0 && sub <= count) {
        if (run && !own.has(sub)) {
          run->last_sub = static_cast<std::uint8_t>(sub);
          continue;
        }
        end_run();
        run = element;
        run->first_sub = run->last_sub = static_cast<std::uint8_t>(sub);
        if (!own.has(sub)) continue;
        apply(own, sub, *sections.main, *run);
        end_run();
      }
    }
    end_run();
  }

  void apply(const OwnEntries& own, unsigned sub, const Section& main, Object& object) {
    if (const KeyValue* const name = own.names[sub]) {
      object.name = ValueReader::text(*name);
      object.line = name->line;
    }
    if (const KeyValue* const value = own.values[sub])
      object.configured = set_value(object, main, *value) || object.configured;
  }

  PerSub entries_per_sub(const Section* section, std::uint8_t count) {
    PerSub entries{};
    if (section == nullptr) return entries;
    for (const KeyValue& entry : section->entries) {
      const std::optional<std::uint64_t> sub = parse_count(entry.key);
      if (!sub || entry.value.empty()) continue;
      if (*sub == 0 || *sub > count) {
        findings_.warning(entry.line, "sub-index {} is not within 1..{} of CompactSubObj: ignored", *sub,
                          count);
      } else if (auto& place = entries[static_cast<std::size_t>(*sub)]; place == nullptr) {
        place = &entry;
      }
    }
    return entries;
  }

  void reject_compact_sections(const ObjectSections& sections) {
    for (const Section* section : {sections.names, sections.values}) {
      if (section == nullptr) continue;
      findings_.warning(section->line,
                        "{} belongs to an object with CompactSubObj, and {:04X}h has none: ignored",
                        bracketed(section->name), sections.index);
    }
  }

  void add(Object object) {
    const bool has_length = size_of(object.type) == 0;
    const std::uint64_t stride = object.capacity + (has_length ? ObjectEntry::kLengthBytes : 0);
    const std::uint64_t bytes = stride * (object.last_sub - object.first_sub + 1U);
    if (value_bytes_ + bytes > kMostValueBytes) {
      findings_.error(object.line, "{:04X}h would take the values of this device beyond {} bytes: left out",
                      object.index, kMostValueBytes);
      return;
    }
    value_bytes_ += bytes;
    objects_.push_back(std::move(object));
  }

  /// nullopt without an ObjectType; an unknown one is VAR.
  std::optional<ObjectType> object_type(const Section& section) {
    const KeyValue* const entry = section.find("ObjectType");
    if (entry == nullptr) return std::nullopt;
    const std::optional<std::uint64_t> code = values_.number(section, "ObjectType", 0xFF);
    if (!code) return std::nullopt;
    const bool known = *code == 0 || *code == 2 || (*code >= 5 && *code <= 9);
    if (known) return static_cast<ObjectType>(*code);
    findings_.warning(entry->line, "ObjectType {} is unknown: VAR is assumed", quoted(entry->value));
    return ObjectType::kVar;
  }

  Object object_of(const Section& section, const Whole& whole, std::uint8_t sub) {
    const bool is_count = sub == 0 && is_structure(whole.type);
    Object object;
    object.index = whole.index;
    object.first_sub = object.last_sub = sub;
    object.line = section.line;
    const KeyValue* const name = section.find("ParameterName");
    object.name = name != nullptr ? ValueReader::text(*name) : base::to_utf8(section.name);
    object.type = data_type(section, whole.index, is_count);
    object.access = access(section);
    object.pdo_mapping = values_.number(section, "PDOMapping", 1).value_or(0) != 0;
    read_capacity(object, section);
    read_value(object, section);
    if (is_count) check_count(object, whole.highest_sub);
    read_limits(object, section);
    if (object.has_value) check_value_against_limits(object);
    return object;
  }

  DataType data_type(const Section& section, std::uint16_t index, bool is_count) {
    const std::optional<std::uint64_t> type = values_.number(section, "DataType", 0xFFFF);
    if (type && is_known(*type)) return static_cast<DataType>(*type);
    if (type) {
      findings_.warning(section.find("DataType")->line, "DataType {}h is unknown: OCTET_STRING is assumed",
                        base::hex(*type, 4));
      return DataType::kOctetString;
    }
    if (object_type(section) == ObjectType::kDomain) return DataType::kDomain;
    const auto standard = standard_type_ != nullptr ? standard_type_(index) : std::nullopt;
    const DataType assumed = is_count ? DataType::kUnsigned8 : standard.value_or(DataType::kUnsigned32);
    findings_.warning(section.line, "{} has no DataType: {} is assumed", bracketed(section.name),
                      name_of(assumed));
    return assumed;
  }

  Access access(const Section& section) {
    const KeyValue* const entry = section.find("AccessType");
    if (entry == nullptr) {
      if (object_type(section) != ObjectType::kDomain)
        findings_.warning(section.line, "{} has no AccessType: rw is assumed", bracketed(section.name));
      return Access::kReadWrite;
    }
    for (const auto& [name, access] : kAccessNames)
      if (base::same_text(name, entry->value)) return access;
    findings_.warning(entry->line, "AccessType {} is unknown: rw is assumed", quoted(entry->value));
    return Access::kReadWrite;
  }

  void read_capacity(Object& object, const Section& section) {
    const std::size_t fixed = size_of(object.type);
    const KeyValue* const entry = section.find(kSizeKey);
    object.capacity = static_cast<std::uint32_t>(fixed);
    if (fixed == 0) object.capacity = object.type == DataType::kDomain ? kDomainCapacity : kStringCapacity;
    if (entry == nullptr) return;
    if (fixed > 0) {
      findings_.warning(entry->line, "{} is for strings and DOMAINs only: ignored", kSizeKey.text());
      return;
    }
    const auto size = values_.number(section, kSizeKey, kMostCapacity, 1);
    if (!size) return;
    object.capacity = static_cast<std::uint32_t>(*size);
    const bool starts_full = object.type == DataType::kOctetString || object.type == DataType::kDomain;
    if (starts_full) object.value.assign(object.capacity, 0);
  }

  void read_value(Object& object, const Section& section) {
    for (const bool configured : {true, false}) {
      const KeyValue* const entry =
          configured ? section.find("ParameterValue") : section.find("DefaultValue");
      if (entry == nullptr || !set_value(object, section, *entry)) continue;
      object.configured = configured;
      return;
    }
    object.value.resize(std::max(object.value.size(), size_of(object.type)));
  }

  /// Gives `object`, which was read from `section`, another value; false if `entry` has no value of its type.
  bool set_value(Object& object, const Section& section, const KeyValue& entry) {
    std::optional<Value> value = values_.value(entry, object.type);
    if (!value) return false;
    const bool has_size = section.find(kSizeKey) != nullptr;
    const std::uint32_t most = has_size ? object.capacity : kMostCapacity;
    if (value->bytes.size() > most && size_of(object.type) == 0) {
      findings_.warning(entry.line, "{} is longer than {} bytes: the rest is cut off", shortened(entry.key),
                        most);
      value->bytes.resize(most);
    }
    object.value = std::move(value->bytes);
    object.has_value = true;
    object.node_ids = value->node_ids;
    object.capacity = std::max(object.capacity, static_cast<std::uint32_t>(object.value.size()));
    return true;
  }

  void read_limits(Object& object, const Section& section) {
    if (!has_limits(object.type)) {
      for (const Key key : {Key("LowLimit"), Key("HighLimit")})
        if (const KeyValue* const entry = section.find(key); entry != nullptr && is_real(object.type))
          findings_.warning(entry->line, "{} of a {} is not checked", shortened(entry->key),
                            name_of(object.type));
      return;
    }
    const auto limit = [&](const Key& key) -> std::optional<std::int64_t> {
      const KeyValue* const entry = section.find(key);
      const auto number = entry == nullptr ? std::nullopt : values_.pattern(*entry, object.type);
      return number ? std::optional(from_bits(number->bits, object.type)) : std::nullopt;
    };
    object.low = limit("LowLimit");
    object.high = limit("HighLimit");
    if (object.low && object.high && less_than(*object.high, *object.low, object.type)) {
      findings_.warning(section.find("LowLimit")->line, "LowLimit is above HighLimit: both are ignored");
      object.low = object.high = std::nullopt;
    }
  }

  void check_value_against_limits(const Object& object) {
    const std::int64_t value = number_in(object);
    const bool too_low = object.low && less_than(value, *object.low, object.type);
    const bool too_high = object.high && less_than(*object.high, value, object.type);
    if (too_low || too_high)
      findings_.warning(object.line, "the value is {}: it is kept",
                        too_low ? "below LowLimit" : "above HighLimit");
  }

  void check_count(Object& object, std::uint8_t highest_sub) {
    const bool read_only = object.access == Access::kReadOnly || object.access == Access::kConstant;
    if (!read_only || object.value.empty()) return;
    if (!object.has_value) {
      object.value.front() = highest_sub;
    } else if (number_in(object) != highest_sub) {
      findings_.warning(object.line, "sub-index 0 says {}, but the highest sub-index is {}: it is kept",
                        number_in(object), highest_sub);
    }
  }

  ValueReader& values_;
  StandardType standard_type_;
  Findings& findings_;
  std::vector<Object> objects_;
  std::uint64_t value_bytes_ = 0;
};

}  // namespace

std::vector<Object> read_objects(const std::vector<ObjectSections>& all, std::size_t count,
                                 ValueReader& values, StandardType standard_type, Findings& findings) {
  ObjectReader reader(count, values, standard_type, findings);
  for (const ObjectSections& sections : all)
    reader.read(sections);
  return reader.take();
}

}  // namespace cbcan::descriptions

// SPDX-License-Identifier: MIT
#include "descriptions/object_reader.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "base/numbers.hpp"
#include "descriptions/diagnostics.hpp"
#include "descriptions/eds_reader.hpp"

namespace cbcan::descriptions {

namespace {

constexpr std::uint8_t kMostSubs = 254;

/// Sub-index 0, if the file has none.
Object count_object(const AttributeReader::Whole& whole, std::size_t line) {
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

}  // namespace

void ObjectReader::read(const ObjectSections& sections) {
  const std::uint8_t count = compact_count(sections);
  const bool has_subs = count > 0 || !sections.subs.empty();
  if (count == 0) reject_compact_sections(sections);
  if (!sections.has_values()) return;
  const std::uint8_t highest = sections.subs.empty() ? count : std::max(count, sections.subs.back().sub);
  const Whole whole{sections.index, object_type(sections, has_subs), highest};
  if (count > 0) {
    read_compact(sections, whole, count);
  } else if (has_subs) {
    read_subs(sections, whole);
  } else if (is_structure(whole.type)) {
    findings_.error(sections.line(),
                    bracketed(sections.main->name) + " should have sub-objects, but has none: left out");
  } else if (whole.type != ObjectType::kNull) {
    add(attributes_.read(*sections.main, whole, 0));
  }
}

std::uint8_t ObjectReader::compact_count(const ObjectSections& sections) {
  if (sections.main == nullptr) return 0;
  const auto count = values_.number(*sections.main, "CompactSubObj", 0xFF).value_or(0);
  if (count > kMostSubs)
    findings_.warning(sections.main->find("CompactSubObj")->line,
                      "CompactSubObj is at most 254: 254 is used");
  return static_cast<std::uint8_t>(std::min<std::uint64_t>(count, kMostSubs));
}

ObjectType ObjectReader::object_type(const ObjectSections& sections, bool has_subs) {
  if (sections.main == nullptr) {
    findings_.warning(sections.line(), "there is no [" + base::hex(sections.index, 4) +
                                           "], but sub-objects of it: a RECORD is assumed");
    return ObjectType::kRecord;
  }
  const std::optional<ObjectType> type = attributes_.object_type(*sections.main);
  if (!has_subs || (type && is_structure(*type))) return type.value_or(ObjectType::kVar);
  findings_.warning(sections.line(), bracketed(sections.main->name) +
                                         " has sub-objects, but is no ARRAY or RECORD: a RECORD is assumed");
  return ObjectType::kRecord;
}

void ObjectReader::read_subs(const ObjectSections& sections, const Whole& whole) {
  if (sections.subs.front().sub != 0) {
    findings_.warning(sections.line(), base::hex(whole.index, 4) +
                                           "h has no sub-index 0: a read-only one that says " +
                                           std::to_string(whole.highest_sub) + " is assumed");
    add(count_object(whole, sections.line()));
  }
  for (const SubSection& sub : sections.subs)
    add(attributes_.read(*sub.section, whole, sub.sub));
}

void ObjectReader::read_compact(const ObjectSections& sections, const Whole& whole, std::uint8_t count) {
  const OwnEntries own{entries_per_sub(sections.names, count), entries_per_sub(sections.values, count)};
  const Object element = attributes_.read(*sections.main, whole, 1);
  auto next = sections.subs.begin();
  if (next == sections.subs.end() || next->sub != 0) add(count_object(whole, sections.line()));

  std::optional<Object> run;
  const auto end_run = [&] {
    if (run) add(*std::exchange(run, std::nullopt));
  };
  for (unsigned sub = 0; sub <= whole.highest_sub; ++sub) {
    if (next != sections.subs.end() && next->sub == sub) {
      end_run();
      add(attributes_.read(*next->section, whole, next->sub));
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

void ObjectReader::apply(const OwnEntries& own, unsigned sub, const Section& main, Object& object) {
  if (const KeyValue* const name = own.names[sub]) {
    object.name = ValueReader::text(*name);
    object.line = name->line;
  }
  if (const KeyValue* const value = own.values[sub])
    object.configured = attributes_.set_value(object, main, *value) || object.configured;
}

ObjectReader::PerSub ObjectReader::entries_per_sub(const Section* section, std::uint8_t count) {
  PerSub entries{};
  if (section == nullptr) return entries;
  for (const KeyValue& entry : section->entries) {
    const std::optional<std::uint64_t> sub = parse_count(entry.key);
    if (!sub || entry.value.empty()) continue;
    if (*sub == 0 || *sub > count) {
      findings_.warning(entry.line, "sub-index " + shortened(entry.key) + " is not within 1.." +
                                        std::to_string(count) + " of CompactSubObj: ignored");
    } else if (auto& place = entries[static_cast<std::size_t>(*sub)]; place == nullptr) {
      place = &entry;
    }
  }
  return entries;
}

void ObjectReader::reject_compact_sections(const ObjectSections& sections) {
  for (const Section* section : {sections.names, sections.values}) {
    if (section == nullptr) continue;
    findings_.warning(section->line, bracketed(section->name) +
                                         " belongs to an object with CompactSubObj, and " +
                                         base::hex(sections.index, 4) + "h has none: ignored");
  }
}

void ObjectReader::add(Object object) {
  const bool has_length = size_of(object.type) == 0;
  const std::uint64_t stride = object.capacity + (has_length ? ObjectEntry::kLengthBytes : 0);
  const std::uint64_t bytes = stride * (object.last_sub - object.first_sub + 1U);
  if (value_bytes_ + bytes > kMostValueBytes) {
    findings_.error(object.line, base::hex(object.index, 4) +
                                     "h would take the values of this device beyond " +
                                     std::to_string(kMostValueBytes) + " bytes: left out");
    return;
  }
  value_bytes_ += bytes;
  objects_.push_back(std::move(object));
}

}  // namespace cbcan::descriptions

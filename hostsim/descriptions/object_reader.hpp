// SPDX-License-Identifier: MIT
#pragma once

/// Makes values from the sections of an object (CiA 306, 4.6).

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "descriptions/device_description.hpp"
#include "descriptions/object_sections.hpp"
#include "descriptions/value_reader.hpp"

namespace cbcan::descriptions {

/// Makes an Object from a section: the keys of CiA 306, 4.6.3.

/// ARRAY, RECORD and DEFSTRUCT have sub-objects.
constexpr bool is_structure(ObjectType type) {
  return type == ObjectType::kArray || type == ObjectType::kRecord || type == ObjectType::kDefStruct;
}

class AttributeReader {
 public:
  /// What the section of a sub-object does not contain.
  struct Whole {
    std::uint16_t index = 0;
    ObjectType type = ObjectType::kVar;
    std::uint8_t highest_sub = 0;
  };

  AttributeReader(ValueReader& values, StandardType standard_type, Findings& findings)
      : values_(values), standard_type_(standard_type), findings_(findings) {}

  /// nullopt without an ObjectType; an unknown one is VAR.
  std::optional<ObjectType> object_type(const Section& section);

  Object read(const Section& section, const Whole& whole, std::uint8_t sub);

  /// Gives `object`, which was read from `section`, another value; false if `entry` has no value of its type.
  bool set_value(Object& object, const Section& section, const KeyValue& entry);

 private:
  DataType data_type(const Section& section, std::uint16_t index, bool is_count);
  Access access(const Section& section);
  void read_capacity(Object& object, const Section& section);
  void read_value(Object& object, const Section& section);
  void read_limits(Object& object, const Section& section);
  void check_value_against_limits(const Object& object);
  void check_count(Object& object, std::uint8_t highest_sub);

  ValueReader& values_;
  StandardType standard_type_;
  Findings& findings_;
};

class ObjectReader {
 public:
  /// `count`: about how many objects there will be.
  ObjectReader(ValueReader& values, StandardType standard_type, Findings& findings, std::size_t count)
      : attributes_(values, standard_type, findings), values_(values), findings_(findings) {
    objects_.reserve(count);
  }

  /// Call it in the order of indices.
  void read(const ObjectSections& sections);

  /// Sorted by index, then sub.
  std::vector<Object> take() { return std::exchange(objects_, {}); }

 private:
  using PerSub = std::array<const KeyValue*, 256>;
  using Whole = AttributeReader::Whole;

  /// The entries of [xxxxName] and [xxxxValue] for single elements; null where there is none.
  struct OwnEntries {
    PerSub names;
    PerSub values;

    bool has(unsigned sub) const { return names[sub] != nullptr || values[sub] != nullptr; }
  };

  std::uint8_t compact_count(const ObjectSections& sections);
  ObjectType object_type(const ObjectSections& sections, bool has_subs);
  void read_subs(const ObjectSections& sections, const Whole& whole);
  void read_compact(const ObjectSections& sections, const Whole& whole, std::uint8_t count);
  void apply(const OwnEntries& own, unsigned sub, const Section& main, Object& object);
  PerSub entries_per_sub(const Section* section, std::uint8_t count);
  void reject_compact_sections(const ObjectSections& sections);
  void add(Object object);

  AttributeReader attributes_;
  ValueReader& values_;
  Findings& findings_;
  std::vector<Object> objects_;
  std::uint64_t value_bytes_ = 0;
};

}  // namespace cbcan::descriptions

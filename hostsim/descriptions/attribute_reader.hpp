// SPDX-License-Identifier: MIT
#pragma once

/// Makes an Object from a section: the keys of CiA 306, 4.6.3.

#include <cstdint>
#include <optional>

#include "descriptions/device_description.hpp"
#include "descriptions/value_reader.hpp"

namespace cbcan::descriptions {

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

}  // namespace cbcan::descriptions

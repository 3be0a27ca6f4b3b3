// SPDX-License-Identifier: MIT
#pragma once

/// Makes values from the sections of an object (CiA 306, 4.6).

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "descriptions/attribute_reader.hpp"
#include "descriptions/object_sections.hpp"

namespace cbcan::descriptions {

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

// SPDX-License-Identifier: MIT
#pragma once

/// Which sections belong to which object (CiA 306, 4.6): [1018], [1018sub1], [1018Name], [1018Value];
/// [1018Denotation] and [1018ObjectLinks] are ignored.

#include <cstdint>
#include <vector>

#include "descriptions/device_description.hpp"
#include "descriptions/lexer.hpp"
#include "descriptions/value_reader.hpp"

namespace cbcan::descriptions {

struct SubSection {
  std::uint8_t sub = 0;
  const Section* section = nullptr;
};

/// The sections of one object; null where there is none.
struct ObjectSections {
  std::uint16_t index = 0;
  const Section* main = nullptr;
  std::vector<SubSection> subs;  ///< ascending
  const Section* names = nullptr;
  const Section* values = nullptr;

  /// False if there is only [xxxxName] or the like.
  bool has_values() const { return main != nullptr || !subs.empty(); }

  /// The line for diagnostics about the whole object.
  std::size_t line() const;
};

/// Ascending by index, with pointers into `sections`.
std::vector<ObjectSections> collect_objects(const std::vector<Section>& sections, Findings& findings);

/// Makes objects from their sections (CiA 306, 4.6). `all`: ascending by index. The result is sorted by index,
/// then sub; `count`: about how many there will be.
std::vector<Object> read_objects(const std::vector<ObjectSections>& all, std::size_t count, ValueReader& values,
                                 StandardType standard_type, Findings& findings);

}  // namespace cbcan::descriptions

// SPDX-License-Identifier: MIT
#pragma once

/// Which sections belong to which object (CiA 306, 4.6): [1018], [1018sub1], [1018Name], [1018Value];
/// [1018Denotation] and [1018ObjectLinks] are ignored.

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "descriptions/device_description.hpp"
#include "descriptions/lexer.hpp"
#include "descriptions/values.hpp"

namespace cbcan::descriptions {

/// A number as the bit pattern of its type.
struct Pattern {
  std::uint64_t bits = 0;
  std::uint32_t node_ids = 0;  ///< how often $NODEID is in it
};

/// The value of a key, as it is on the bus.
struct Value {
  std::vector<std::uint8_t> bytes;
  std::uint32_t node_ids = 0;  ///< how often $NODEID is in it
};

/// Values of keys, with a diagnostic for each value that cannot be read.
class ValueReader {
 public:
  /// Without a node ID $NODEID is 0, and its first use is reported.
  ValueReader(Findings& findings, std::optional<std::uint8_t> node_id)
      : findings_(findings), node_id_(node_id) {}

  /// nullopt if the key is missing, empty, no number, or not within lowest..highest.
  std::optional<std::uint64_t> number(const Section& section, const Key& key, std::uint64_t highest,
                                      std::uint64_t lowest = 0);

  /// The same, for a key that exists.
  std::optional<std::uint64_t> number(const KeyValue& entry, std::uint64_t highest, std::uint64_t lowest = 0);

  /// UTF-8, cut to the longest line of CiA 306.
  static std::string text(const KeyValue& entry);

  /// An integer, REAL or time; nullopt if the value is none of this type.
  std::optional<Pattern> pattern(const KeyValue& entry, DataType type);

  /// A value of any type.
  std::optional<Value> value(const KeyValue& entry, DataType type);

 private:
  std::optional<Number> integer(const KeyValue& entry);
  std::optional<Number> unusual_integer(const KeyValue& entry);
  std::string_view without_comment(const KeyValue& entry);

  Findings& findings_;
  std::optional<std::uint8_t> node_id_;
  bool missing_node_id_reported_ = false;
};

enum class Part : std::uint8_t { kMain, kSub, kNames, kValues, kUnused };

/// The object that a section belongs to, and what it describes of it. Neither number is checked.
struct SectionPlace {
  std::uint64_t index = 0;
  Part part = Part::kMain;
  std::uint64_t sub = 0;
  auto operator<=>(const SectionPlace&) const = default;
};

/// The sections that list a file's objects (CiA 306, 4.6.1).
inline constexpr std::array<std::string_view, 3> kObjectLists{"MandatoryObjects", "OptionalObjects",
                                                              "ManufacturerObjects"};
/// Their text; `indices` are sorted.
std::string object_lists(std::span<const std::uint64_t> indices);

/// nullopt for a name of another form than 1018, 1018sub1, 1018Name.
std::optional<SectionPlace> parse_section_name(std::string_view name);

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

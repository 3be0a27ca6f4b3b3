// SPDX-License-Identifier: MIT
#include "eds/object_lists.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "cbcan/canopen/dictionary/objects.hpp"
#include "eds/device_sections.hpp"
#include "eds/diagnostics.hpp"
#include "text/numbers.hpp"

namespace cbcan::eds {

namespace {

constexpr std::array<std::string_view, 3> kLists = {"MandatoryObjects", "OptionalObjects",
                                                    "ManufacturerObjects"};

/// Below it there are data types, which no list has to name.

struct Listed {
  std::uint64_t index = 0;
  std::size_t line = 0;
};

struct Position {
  std::uint64_t number = 0;
  std::size_t line = 0;
};

class ListChecker {
 public:
  ListChecker(ValueReader& values, Findings& findings) : values_(values), findings_(findings) {}

  void take(const Section& list) {
    has_list_ = true;
    std::vector<Position> positions;
    for (const KeyValue& entry : list.entries) {
      const std::optional<std::uint64_t> position = parse_count(entry.key);
      if (!position || entry.value.empty()) continue;
      positions.push_back({*position, entry.line});
      if (const auto index = values_.pattern(entry, DataType::kUnsigned16))
        listed_.push_back({index->bits, entry.line});
    }
    check_numbering(list, positions);
  }

  void compare(const std::vector<ObjectSections>& objects) {
    std::stable_sort(listed_.begin(), listed_.end(),
                     [](const Listed& a, const Listed& b) { return a.index < b.index; });
    report_repeated();
    for (const Listed& listed : listed_)
      if (!has_object(objects, listed.index))
        findings_.error(listed.line, "object " + text::hex(listed.index, 4) +
                                         "h is listed, but there is no [" + text::hex(listed.index, 4) +
                                         "]: left out");
    report_unlisted(objects);
  }

 private:
  void check_numbering(const Section& list, std::vector<Position>& positions) {
    std::stable_sort(positions.begin(), positions.end(),
                     [](const Position& a, const Position& b) { return a.number < b.number; });
    std::uint64_t due = 1;
    for (const Position& position : positions) {
      if (position.number != due)
        findings_.note(position.line, bracketed(list.name) + " goes on with " +
                                          std::to_string(position.number) + " where " + std::to_string(due) +
                                          " is due");
      due = position.number + 1;
    }
    values_.check_count(list, "SupportedObjects", positions.size());
  }

  void report_repeated() {
    for (std::size_t i = 1; i < listed_.size(); ++i)
      if (listed_[i].index == listed_[i - 1].index)
        findings_.note(listed_[i].line, "object " + text::hex(listed_[i].index, 4) +
                                            "h is listed already in line " +
                                            std::to_string(listed_[i - 1].line));
    const auto same_index = [](const Listed& a, const Listed& b) { return a.index == b.index; };
    listed_.erase(std::unique(listed_.begin(), listed_.end(), same_index), listed_.end());
  }

  void report_unlisted(const std::vector<ObjectSections>& objects) {
    if (!has_list_ && !objects.empty())
      findings_.note(objects.front().line(),
                     "there is none of [MandatoryObjects], [OptionalObjects], [ManufacturerObjects]: all "
                     "sections of objects are used");
    if (!has_list_) return;
    for (const ObjectSections& object : objects) {
      const bool is_listed =
          std::binary_search(listed_.begin(), listed_.end(), Listed{object.index, 0},
                             [](const Listed& a, const Listed& b) { return a.index < b.index; });
      if (!is_listed && object.has_values() && object.index >= object::kFirstCommunication)
        findings_.note(object.line(), "object " + text::hex(object.index, 4) + "h is not listed: it is used");
    }
  }

  static bool has_object(const std::vector<ObjectSections>& objects, std::uint64_t index) {
    const auto found = std::partition_point(
        objects.begin(), objects.end(), [&](const ObjectSections& object) { return object.index < index; });
    return found != objects.end() && found->index == index && found->has_values();
  }

  ValueReader& values_;
  Findings& findings_;
  std::vector<Listed> listed_;
  bool has_list_ = false;
};

}  // namespace

void check_object_lists(const std::vector<Section>& sections, const std::vector<ObjectSections>& objects,
                        ValueReader& values, Findings& findings) {
  ListChecker checker(values, findings);
  for (const std::string_view name : kLists)
    if (const Section* const list = find_section(sections, name, findings)) checker.take(*list);
  checker.compare(objects);
}

}  // namespace cbcan::eds

// SPDX-License-Identifier: MIT
#include "sim/parameters.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/objects.hpp"

namespace cbcan::sim {

namespace {

bool is_parameter(const ObjectEntry& entry) {
  const bool is_command = entry.index == object::kStore || entry.index == object::kRestore ||
                          entry.index == object::kErrorHistory;
  return entry.has(ObjectFlags::kRead) && entry.has(ObjectFlags::kWrite) &&
         !entry.has(ObjectFlags::kSetPoint) && !is_command;
}

}  // namespace

void copy_parameters(std::span<const ObjectEntry> entries, std::span<const std::uint8_t> from,
                     std::span<std::uint8_t> to, std::uint16_t first_index, std::uint16_t last_index) {
  for (const ObjectEntry& entry : entries)
    if (is_parameter(entry) && entry.index >= first_index && entry.index <= last_index)
      restore_values(std::span(&entry, 1), from, to, first_index, last_index);
}

std::vector<StoredValue> changed_parameters(std::span<const ObjectEntry> entries,
                                            std::span<std::uint8_t> factory, std::span<std::uint8_t> saved) {
  const ObjectDictionary before(entries, factory, nullptr);
  const ObjectDictionary after(entries, saved, nullptr);
  std::vector<StoredValue> changed;
  for (const ObjectEntry& entry : entries) {
    if (!is_parameter(entry)) continue;
    for (unsigned sub = entry.first_sub; sub <= entry.last_sub; ++sub) {
      const auto number = static_cast<std::uint8_t>(sub);
      const auto value = after.value(entry, number);
      if (!std::ranges::equal(value, before.value(entry, number)))
        changed.push_back({entry.index, number, {value.begin(), value.end()}});
    }
  }
  return changed;
}

std::vector<StoredValue> put_parameters(const std::vector<StoredValue>& values, ObjectDictionary& saved) {
  std::vector<StoredValue> left_out;
  for (const StoredValue& value : values) {
    ObjectEntry entry{};
    const bool fits = saved.find(value.index, value.sub, entry) == AbortCode::kNone && is_parameter(entry) &&
                      value.bytes.size() <= entry.capacity &&
                      (entry.has(ObjectFlags::kVariable) || value.bytes.size() == entry.capacity);
    fits ? saved.store(entry, value.sub, value.bytes) : left_out.push_back(value);
  }
  return left_out;
}

}  // namespace cbcan::sim

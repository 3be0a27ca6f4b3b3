// SPDX-License-Identifier: MIT
#include "sim/parameters.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/canopen/manager/network_objects.hpp"

namespace cbcan::sim {

namespace {

bool is_parameter(const ObjectEntry& entry) {
  const bool is_command = entry.index == object::kStore || entry.index == object::kRestore ||
                          entry.index == object::kErrorHistory || NetworkObjects::is_network(entry.index);
  return entry.has(ObjectFlags::kRead) && entry.has(ObjectFlags::kWrite) &&
         !entry.has(ObjectFlags::kSetPoint) && !entry.has(ObjectFlags::kProcess) && !is_command;
}

/// All of them, computed ones too.
std::vector<StoredValue> parameters_of(const ObjectDictionary& objects) {
  std::vector<StoredValue> all;
  for (const ObjectEntry& entry : objects.entries()) {
    if (!is_parameter(entry)) continue;
    for (unsigned index = entry.index; index <= entry.last_index(); ++index)
      for (unsigned sub = entry.first_sub; sub <= entry.last_sub; ++sub) {
        StoredValue value{static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub),
                          std::vector<std::uint8_t>(entry.capacity)};
        std::size_t size = 0;
        static_cast<void>(objects.read(value.index, value.sub, value.bytes, size, 0));
        value.bytes.resize(size);
        all.push_back(std::move(value));
      }
  }
  return all;
}

/// The values that differ from those in `standard`, which has the same objects.
std::vector<StoredValue> differing(std::vector<StoredValue> values, const std::vector<StoredValue>& standard) {
  std::erase_if(values, [next = standard.begin()](const StoredValue& value) mutable {
    return value == *next++;
  });
  return values;
}

auto is_in(std::uint16_t first_index, std::uint16_t last_index) {
  return [=](const StoredValue& value) { return first_index <= value.index && value.index <= last_index; };
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
  return differing(parameters_of({entries, saved, nullptr}), parameters_of({entries, factory, nullptr}));
}

std::vector<StoredValue> put_parameters(std::span<const StoredValue> values, ObjectDictionary& saved,
                                        ObjectHandler* handler) {
  std::vector<StoredValue> left_out;
  for (const StoredValue& value : values) {
    ObjectEntry entry{};
    const bool fits = saved.find(value.index, value.sub, entry) == AbortCode::kNone && is_parameter(entry) &&
                      value.bytes.size() <= entry.capacity &&
                      (entry.has(ObjectFlags::kVariable) || value.bytes.size() == entry.capacity);
    if (!fits)
      left_out.push_back(value);
    else if (handler != nullptr && entry.has(ObjectFlags::kComputed))
      handler->on_write(entry, value.sub, value.bytes, 0);
    else
      saved.store(entry, value.sub, value.bytes);
  }
  return left_out;
}

// ---- Of a module

AbortCode ModuleParameters::save(std::uint16_t first_index, std::uint16_t last_index) {
  return keep(differing(parameters_of(*objects_), power_on_), first_index, last_index);
}

AbortCode ModuleParameters::forget(std::uint16_t first_index, std::uint16_t last_index) {
  return keep({}, first_index, last_index);
}

/// Replaces what is stored of this range; other objects keep theirs.
AbortCode ModuleParameters::keep(std::vector<StoredValue> changed, std::uint16_t first_index,
                                 std::uint16_t last_index) {
  const auto in_range = is_in(first_index, last_index);
  StoredParameters next = stored_;
  std::erase_if(next.values, in_range);
  std::ranges::copy_if(changed, std::back_inserter(next.values), in_range);
  std::ranges::sort(next.values, {},
                    [](const StoredValue& value) { return std::pair(value.index, value.sub); });
  return keep(std::move(next)) ? AbortCode::kNone : AbortCode::kHardware;
}

bool ModuleParameters::keep_address(std::uint8_t node_id, std::uint8_t bit_rate) {
  StoredParameters next = stored_;
  next.lss.node_id = node_id;
  if (bit_rate != kReservedLssBitRate) next.lss.bit_rate = kLssBitRates[bit_rate];
  return keep(std::move(next));
}

bool ModuleParameters::keep(StoredParameters next) {
  const bool kept = store_->save(next);
  if (kept) stored_ = std::move(next);
  return kept;
}

void ModuleParameters::load(ObjectDictionary& objects, ObjectHandler& handler, std::uint16_t first_index,
                            std::uint16_t last_index) {
  const bool is_first = std::exchange(objects_, &objects) == nullptr;
  if (is_first) power_on_ = parameters_of(objects);
  std::vector<StoredValue> values;
  std::ranges::copy_if(stored_.values, std::back_inserter(values), is_in(first_index, last_index));
  const std::vector<StoredValue> left_out = put_parameters(values, objects, &handler);
  if (is_first && !left_out.empty()) store_->tell_left_out(left_out);
}

}  // namespace cbcan::sim

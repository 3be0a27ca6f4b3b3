// SPDX-License-Identifier: MIT
#include "sim/parameters.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>

#include "base/error.hpp"
#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/canopen/manager/network_objects.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"

namespace cbcan::sim {

namespace {

bool is_parameter(const ObjectEntry& entry) {
  const bool is_command = entry.index == object::kStore || entry.index == object::kRestore ||
                          entry.index == object::kErrorHistory || NetworkObjects::is_network(entry.index);
  return entry.has(ObjectFlags::kRead) && entry.has(ObjectFlags::kWrite | ObjectFlags::kKept) &&
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
std::vector<StoredValue> differing(std::vector<StoredValue> values,
                                   const std::vector<StoredValue>& standard) {
  std::erase_if(values,
                [next = standard.begin()](const StoredValue& value) mutable { return value == *next++; });
  return values;
}

auto is_in(std::uint16_t first_index, std::uint16_t last_index) {
  return [=](const StoredValue& value) { return first_index <= value.index && value.index <= last_index; };
}

constexpr std::string_view kHeading =
    "# Written by object 1010h (store parameters) and LSS.\n"
    "# index:sub-index = bytes, low byte first\n";
constexpr std::string_view kNodeId = "node-id";
constexpr std::string_view kBitRate = "bit-rate";

/// False: not a number, or it does not fit.
template <class Number>
bool read_number(std::string_view text, Number& number, int base) {
  const auto read = base::parse<Number>(base::trim(text), base);
  if (read) number = *read;
  return read.has_value();
}

bool parse_object(std::string_view object, std::string_view digits, StoredValue& value) {
  const auto address = base::split(object, ':');
  if (!address || digits.size() % 2 != 0 || !read_number(address->first, value.index, 16) ||
      !read_number(address->second, value.sub, 16))
    return false;
  for (std::size_t at = 0; at < digits.size(); at += 2)
    if (!read_number(digits.substr(at, 2), value.bytes.emplace_back(), 16)) return false;
  return true;
}

bool is_node_id(std::uint8_t id) {
  return (id >= 1 && id <= nmt::kMaxNode) || id == LssSlave::kNoNodeId;
}

/// False: the line is invalid.
bool parse_line(std::string_view line, StoredParameters& parameters) {
  const auto sides = base::split(line, '=');
  if (!sides) return false;
  const std::string_view key = base::trim(sides->first);
  const std::string_view value = base::trim(sides->second);
  if (key == kNodeId)
    return read_number(value, parameters.lss.node_id, 10) && is_node_id(parameters.lss.node_id);
  if (key == kBitRate) return read_number(value, parameters.lss.bit_rate, 10);
  parameters.values.emplace_back();
  return parse_object(key, value, parameters.values.back());
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
                      saved.check(entry, value.sub, value.bytes) == AbortCode::kNone;
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

bool ModuleParameters::load(ObjectDictionary& objects, ObjectHandler& handler, std::uint16_t first_index,
                            std::uint16_t last_index, std::uint32_t /*step*/) {
  const bool is_first = std::exchange(objects_, &objects) == nullptr;
  if (is_first) power_on_ = parameters_of(objects);
  std::vector<StoredValue> values;
  std::ranges::copy_if(stored_.values, std::back_inserter(values), is_in(first_index, last_index));
  const std::vector<StoredValue> left_out = put_parameters(values, objects, &handler);
  if (is_first && !left_out.empty()) store_->tell_left_out(left_out);
  return false;
}

std::string parameter_text(const StoredParameters& parameters) {
  std::string text(kHeading);
  if (parameters.lss.node_id != 0)
    text +=
        fmt::format("{} = {}\n{} = {}\n", kNodeId, parameters.lss.node_id, kBitRate, parameters.lss.bit_rate);
  for (const StoredValue& value : parameters.values)
    text += fmt::format("{:04X}:{:02X} = {}\n", value.index, value.sub, base::hex(value.bytes, ""));
  return text;
}

StoredParameters parse_parameters(std::string_view text, const std::string& path) {
  StoredParameters parameters;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = base::trim(base::take_line(text));
    if (line.empty() || line.front() == '#' || parse_line(line, parameters)) continue;
    throw base::UsageError(
        fmt::format("{}:{}: \"{}\": write INDEX:SUB = BYTES in hexadecimal, such as 1017:00 = E803, "
                    "node-id = 1..127 or bit-rate = 250000",
                    path, number, line));
  }
  return parameters;
}

StoredParameters ParameterText::load() {
  const std::optional<std::string> text = read();
  return text ? parse_parameters(*text, path_) : StoredParameters();
}

void ParameterText::tell_left_out(const std::vector<StoredValue>& values) {
  constexpr std::size_t kMostNamed = 20;
  std::string names;
  for (const StoredValue& value : std::span(values).first(std::min(values.size(), kMostNamed)))
    names += fmt::format("{}{:04X}:{:02X}", names.empty() ? "" : ", ", value.index, value.sub);
  if (values.size() > kMostNamed) names += fmt::format(" and {} more", values.size() - kMostNamed);
  warn_(fmt::format("{}: left out, as the node has no such parameter of this length: {}", path_, names));
}

}  // namespace cbcan::sim

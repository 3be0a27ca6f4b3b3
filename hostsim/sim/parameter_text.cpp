// SPDX-License-Identifier: MIT
#include "sim/parameter_text.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <span>

#include "base/error.hpp"
#include "base/numbers.hpp"
#include "base/words.hpp"
#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"

namespace cbcan::sim {

namespace {

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

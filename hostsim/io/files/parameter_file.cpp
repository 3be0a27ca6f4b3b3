// SPDX-License-Identifier: MIT
#include "io/files/parameter_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <memory>
#include <optional>

#include "canopen/lss_slave.hpp"
#include "canopen/nmt/nmt.hpp"
#include "io/files/read_file.hpp"

namespace cbcan::io {

namespace {

constexpr std::string_view kHeading =
    "# Written by object 1010h (store parameters) and LSS of a simulated node.\n"
    "# index:sub-index = bytes, low byte first\n";
constexpr std::string_view kNodeId = "node-id";
constexpr std::string_view kBitRate = "bit-rate";

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

template <class Number>
bool parse_number(std::string_view text, Number& number, int base) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  return error == std::errc{} && end == text.data() + text.size();
}

bool parse_object(std::string_view object, std::string_view digits, sim::StoredValue& value) {
  const auto colon = object.find(':');
  if (colon == std::string_view::npos || digits.size() % 2 != 0 ||
      !parse_number(trim(object.substr(0, colon)), value.index, 16) ||
      !parse_number(trim(object.substr(colon + 1)), value.sub, 16))
    return false;
  for (std::size_t at = 0; at < digits.size(); at += 2) {
    value.bytes.emplace_back();
    if (!parse_number(digits.substr(at, 2), value.bytes.back(), 16)) return false;
  }
  return true;
}

bool is_node_id(std::uint8_t id) {
  return (id >= 1 && id <= nmt::kMaxNode) || id == LssSlave::kNoNodeId;
}

/// False: the line means nothing.
bool parse_line(std::string_view line, sim::StoredParameters& parameters) {
  const auto equals = line.find('=');
  if (equals == std::string_view::npos) return false;
  const std::string_view key = trim(line.substr(0, equals));
  const std::string_view value = trim(line.substr(equals + 1));
  if (key == kNodeId)
    return parse_number(value, parameters.lss.node_id, 10) && is_node_id(parameters.lss.node_id);
  if (key == kBitRate) return parse_number(value, parameters.lss.bit_rate, 10);
  parameters.values.emplace_back();
  return parse_object(key, value, parameters.values.back());
}

bool write_whole(const std::string& path, const std::string& text) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wb"), std::fclose);
  if (!file) return false;
  return std::fwrite(text.data(), 1, text.size(), file.get()) == text.size() &&
         std::fflush(file.get()) == 0 && ::fsync(::fileno(file.get())) == 0;
}

}  // namespace

std::string parameter_text(const sim::StoredParameters& parameters) {
  std::string text(kHeading);
  if (parameters.lss.node_id != 0) {
    text += std::string(kNodeId) + " = " + std::to_string(parameters.lss.node_id) + "\n";
    text += std::string(kBitRate) + " = " + std::to_string(parameters.lss.bit_rate) + "\n";
  }
  for (const sim::StoredValue& value : parameters.values) {
    char number[16];
    std::snprintf(number, sizeof number, "%04X:%02X = ", value.index, value.sub);
    text += number;
    for (const std::uint8_t byte : value.bytes) {
      std::snprintf(number, sizeof number, "%02X", byte);
      text += number;
    }
    text += '\n';
  }
  return text;
}

sim::StoredParameters parse_parameters(std::string_view text, const std::string& path) {
  sim::StoredParameters parameters;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    const std::string_view line = trim(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.front() == '#' || parse_line(line, parameters)) continue;
    throw UsageError(
        path + ":" + std::to_string(number) + ": \"" + std::string(line) +
        "\": write INDEX:SUB = BYTES in hexadecimal, such as 1017:00 = E803, node-id = 1..127 or "
        "bit-rate = 250000");
  }
  return parameters;
}

sim::StoredParameters ParameterFile::load() {
  const std::optional<std::string> text = read_file(path_);
  if (text) return parse_parameters(*text, path_);
  if (::access(path_.c_str(), F_OK) == 0)
    throw UsageError(path_ + ": this file with stored parameters cannot be read; check its permissions");
  return {};
}

bool ParameterFile::save(const sim::StoredParameters& parameters) {
  const std::string fresh = path_ + ".new";
  if (write_whole(fresh, parameter_text(parameters)) && std::rename(fresh.c_str(), path_.c_str()) == 0)
    return true;
  warn_(path_ + ": parameters could not be stored: " + reason(errno));
  static_cast<void>(std::remove(fresh.c_str()));
  return false;
}

}  // namespace cbcan::io

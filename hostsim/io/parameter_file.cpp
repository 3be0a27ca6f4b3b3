// SPDX-License-Identifier: MIT
#include "io/parameter_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <memory>
#include <optional>

#include "io/files.hpp"

namespace cbcan::io {

namespace {

constexpr std::string_view kHeading =
    "# Written by object 1010h (store parameters) of a simulated node: index:sub-index = bytes, low byte "
    "first\n";

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

template <class Number>
bool parse_hex(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, 16);
  return error == std::errc{} && end == text.data() + text.size();
}

std::optional<sim::StoredValue> parse_line(std::string_view line) {
  const auto colon = line.find(':');
  const auto equals = line.find('=');
  if (colon == std::string_view::npos || equals == std::string_view::npos || colon > equals)
    return std::nullopt;
  sim::StoredValue value;
  const std::string_view digits = trim(line.substr(equals + 1));
  if (!parse_hex(trim(line.substr(0, colon)), value.index) ||
      !parse_hex(trim(line.substr(colon + 1, equals - colon - 1)), value.sub) || digits.size() % 2 != 0)
    return std::nullopt;
  for (std::size_t at = 0; at < digits.size(); at += 2) {
    std::uint8_t byte = 0;
    if (!parse_hex(digits.substr(at, 2), byte)) return std::nullopt;
    value.bytes.push_back(byte);
  }
  return value;
}

bool write_whole(const std::string& path, const std::string& text) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wb"), std::fclose);
  if (!file) return false;
  return std::fwrite(text.data(), 1, text.size(), file.get()) == text.size() &&
         std::fflush(file.get()) == 0 && ::fsync(::fileno(file.get())) == 0;
}

}  // namespace

std::string parameter_text(const std::vector<sim::StoredValue>& values) {
  std::string text(kHeading);
  for (const sim::StoredValue& value : values) {
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

std::vector<sim::StoredValue> parse_parameters(std::string_view text, const std::string& path) {
  std::vector<sim::StoredValue> values;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    const std::string_view line = trim(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.front() == '#') continue;
    auto value = parse_line(line);
    if (!value)
      throw UsageError(path + ":" + std::to_string(number) + ": \"" + std::string(line) +
                       "\": write INDEX:SUB = BYTES in hexadecimal, such as 1017:00 = E803");
    values.push_back(std::move(*value));
  }
  return values;
}

std::vector<sim::StoredValue> ParameterFile::load() {
  const std::optional<std::string> text = read_file(path_);
  if (text) return parse_parameters(*text, path_);
  if (::access(path_.c_str(), F_OK) == 0)
    throw UsageError(path_ + ": this file with stored parameters cannot be read; check its permissions");
  return {};
}

bool ParameterFile::save(const std::vector<sim::StoredValue>& values) {
  const std::string fresh = path_ + ".new";
  if (write_whole(fresh, parameter_text(values)) && std::rename(fresh.c_str(), path_.c_str()) == 0)
    return true;
  warn_(path_ + ": parameters could not be stored: " + reason(errno));
  static_cast<void>(std::remove(fresh.c_str()));
  return false;
}

}  // namespace cbcan::io

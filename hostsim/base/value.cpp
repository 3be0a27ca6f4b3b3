// SPDX-License-Identifier: MIT
#include "base/value.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "base/text.hpp"

namespace cbcan::base {
namespace {

constexpr std::string_view kHexPrefix = "hex:";

std::string quoted(std::string_view text, bool (*is_plain)(unsigned char)) {
  std::string result = "\"";
  for (const char c : text)
    if (const auto code = static_cast<unsigned char>(c); !is_plain(code))
      result += fmt::format("\\u{:04X}", code);
    else
      result.append(c == '"' || c == '\\' ? "\\" : "") += c;
  return result + '"';
}

bool is_quoted(std::string_view text) {
  return text.size() >= 2 && text.front() == '"' && text.back() == '"';
}

}  // namespace

bool is_hex(std::string_view text) {
  return text.starts_with(kHexPrefix);
}

std::optional<Bytes> parse_octets(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  Bytes bytes;
  while (!text.empty()) {
    if (kBlanks.find(text.front()) != kBlanks.npos) {
      text.remove_prefix(1);
      continue;
    }
    const auto byte = parse<std::uint8_t>(text.substr(0, 2), 16);
    if (!byte || text.size() < 2) return std::nullopt;
    bytes.push_back(*byte);
    text.remove_prefix(2);
  }
  return bytes;
}

std::optional<Bytes> parse_hex(std::string_view text) {
  return parse_octets(is_hex(text) ? text.substr(kHexPrefix.size()) : text);
}

Value parse_value(std::string_view text) {
  if (text == "true") return true;
  if (text == "false") return false;
  if (const auto integer = parse_integer(text)) return *integer;
  // Without a digit it is "inf" or "nan", which are words in a text.
  const bool has_digit = text.find_first_of("0123456789") != std::string_view::npos;
  if (const auto number = parse<double>(text); number && has_digit) return *number;
  return std::string(is_quoted(text) ? text.substr(1, text.size() - 2) : text);
}

std::string toml_text(std::string_view text) {
  std::string blanked = as_utf8(text);
  std::ranges::replace(blanked, '\t', ' ');
  return quoted(blanked, [](unsigned char c) { return c >= ' ' && c != 0x7F; });
}

std::string json_text(std::string_view text) {
  return quoted(text, [](unsigned char c) { return c >= ' ' && c < 0x7F; });
}

void append_value(Buffer& to, std::span<const std::uint8_t> bytes) {
  append(to, '"', kHexPrefix, HexBytes{bytes, " "}, '"');
}

std::string value_text(const Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return '"' + *text + '"';
  if (const auto* boolean = std::get_if<bool>(&value)) return *boolean ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return std::to_string(*integer);
  const auto* const bytes = std::get_if<Bytes>(&value);
  return made(
      [&](Buffer& to) { bytes != nullptr ? append_value(to, *bytes) : append(to, std::get<double>(value)); });
}

}  // namespace cbcan::base

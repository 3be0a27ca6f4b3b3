// SPDX-License-Identifier: MIT
#include "app/value.hpp"

#include <array>
#include <cctype>
#include <charconv>
#include <cstdio>

namespace cbcan::app {
namespace {

constexpr std::string_view kHexPrefix = "hex:";

template <class Number, class... Base>
std::optional<Number> parse_whole(std::string_view text, Base... base) {
  Number number{};
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, number, base...);
  if (result.ec != std::errc{} || result.ptr != end) return std::nullopt;
  return number;
}

/// from_chars also takes "inf" and "nan", which are words in a text.
std::optional<double> parse_float(std::string_view text) {
  if (text.find_first_of("0123456789") == std::string_view::npos) return std::nullopt;
  return parse_whole<double>(text);
}

bool is_quoted(std::string_view text) {
  return text.size() >= 2 && text.front() == '"' && text.back() == '"';
}

std::string quoted(std::string_view text) {
  return '"' + std::string(text) + '"';
}

std::string float_text(double number) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), number);
  const std::string digits(text.data(), result.ptr);
  return digits.find_first_not_of("-0123456789") == std::string::npos ? digits + ".0" : digits;
}

std::string hex_text(const Bytes& bytes) {
  std::string text(kHexPrefix);
  for (const std::uint8_t byte : bytes) {
    std::array<char, 4> digits{};
    std::snprintf(digits.data(), digits.size(), "%02X ", byte);
    text += digits.data();
  }
  if (text.back() == ' ') text.pop_back();
  return text;
}

}  // namespace

std::optional<std::int64_t> parse_integer(std::string_view text) {
  if (text.starts_with("0x") || text.starts_with("0X")) {
    if (text.substr(2).starts_with('-')) return std::nullopt;
    return parse_whole<std::int64_t>(text.substr(2), 16);
  }
  return parse_whole<std::int64_t>(text, 10);
}

bool is_hex(std::string_view text) {
  return text.starts_with(kHexPrefix);
}

std::optional<Bytes> parse_hex(std::string_view text) {
  Bytes bytes;
  text.remove_prefix(kHexPrefix.size());
  while (!text.empty()) {
    if (text.front() == ' ') {
      text.remove_prefix(1);
      continue;
    }
    const auto byte = parse_whole<std::uint8_t>(text.substr(0, 2), 16);
    if (!byte || text.size() < 2) return std::nullopt;
    bytes.push_back(*byte);
    text.remove_prefix(2);
  }
  return bytes;
}

Value parse_value(std::string_view text) {
  if (text == "true") return true;
  if (text == "false") return false;
  if (const auto integer = parse_integer(text)) return *integer;
  if (const auto number = parse_float(text)) return *number;
  if (is_quoted(text)) return std::string(text.substr(1, text.size() - 2));
  return std::string(text);
}

std::string value_text(const Value& value) {
  if (const auto* boolean = std::get_if<bool>(&value)) return *boolean ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return std::to_string(*integer);
  if (const auto* number = std::get_if<double>(&value)) return float_text(*number);
  if (const auto* text = std::get_if<std::string>(&value)) return quoted(*text);
  return quoted(hex_text(std::get<Bytes>(value)));
}

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#include "base/setting.hpp"

#include <algorithm>
#include <cmath>

#include "base/address.hpp"

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

bool is_whole(const Row& row) {
  return row.form == Form::kInteger || row.form == Form::kHexadecimal;
}

bool has_form(const Row& row, const Value& value) {
  const bool whole = std::holds_alternative<std::int64_t>(value);
  if (is_whole(row)) return whole;
  if (row.form == Form::kNumber) return whole || std::holds_alternative<double>(value);
  if (row.form == Form::kBoolean) return std::holds_alternative<bool>(value);
  if (row.form == Form::kAny || (row.form == Form::kLines && whole && row.high != 0)) return true;
  const auto* text = std::get_if<std::string>(&value);
  if (text == nullptr || row.form != Form::kDuration) return text != nullptr;
  return parse_duration(*text) >= static_cast<std::uint64_t>(row.low);
}

/// Compares so that NaN is out of every range.
bool in_range(const Row& row, const Value& value) {
  if (!row.numbers.empty())
    return std::ranges::find(row.numbers, std::get<std::int64_t>(value)) != row.numbers.end();
  if (row.form == Form::kAny || row.form == Form::kLines) return true;
  if (const auto* text = std::get_if<std::string>(&value)) return !text->empty();
  if (const auto* whole = std::get_if<std::int64_t>(&value))
    return row.low == row.high || (*whole >= row.low && *whole <= row.high);
  const auto* number = std::get_if<double>(&value);
  if (number == nullptr) return true;
  return std::isfinite(*number) && (row.low == row.high || (*number >= static_cast<double>(row.low) &&
                                                            *number <= static_cast<double>(row.high)));
}

/// Eight digits for 32 bits, four for an index, three for a CAN-ID.
std::string whole_text(const Row& row, std::int64_t whole) {
  if (row.form != Form::kHexadecimal) return std::to_string(whole);
  const bool is_index = row.high > 0xFFF && row.high <= 0xFFFF;
  return "0x" + hex(static_cast<std::uint64_t>(whole), whole > 0xFFFF              ? 8
                                                       : whole > 0xFFF || is_index ? 4
                                                                                   : 3);
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

std::int64_t detail::place_of(const Row& row, const Value& value) {
  return std::ranges::find(row.choices, std::get<std::string>(value)) - row.choices.begin();
}

std::string detail::list_text(std::span<const Line> lines) {
  std::string text;
  for (const Line& line : lines)
    text += (text.empty() ? "[" : ", ") + toml_text(line.text);
  return text.empty() ? text : text + ']';
}

bool is_text(const Row& row) {
  return row.form == Form::kText || row.form == Form::kPath || row.form == Form::kAddress;
}

std::string domain_of(const Row& row) {
  std::vector<std::string> numbers;
  for (const int number : row.numbers)
    numbers.push_back(std::to_string(number));
  if (!numbers.empty()) return listed(std::vector<std::string_view>(numbers.begin(), numbers.end()));
  if (!row.choices.empty()) return listed(row.choices);
  if (!row.domain.empty()) return std::string(row.domain);
  if (row.form == Form::kBoolean) return "true or false";
  if (is_text(row)) return "a text";
  if (row.low == row.high) return "a number";
  return fmt::format("{}..{}{}", whole_text(row, row.low), whole_text(row, row.high), row.unit);
}

std::string written(const Row& row, const Value& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return whole_text(row, *whole);
  if (const auto* number = std::get_if<double>(&value)) return fmt::format("{}", *number);
  if (const auto* word = std::get_if<std::string>(&value)) return *word;
  return value_text(value);
}

Problem wrong_form(const Row& row) {
  if (row.form == Form::kLines) return "must be a text, or a list of them";
  if (row.form == Form::kDuration)
    return fmt::format("write {} = \"100ms\": a whole number of us, ms or s, a year at most", row.key);
  const char* form = is_whole(row) ? "an integer, " : is_text(row) ? "a text in double quotes: " : "";
  return fmt::format("must be {}{}", form, row.domain.empty() ? domain_of(row) : row.domain);
}

Problem check(const Row& row, const Value& value) {
  if (!has_form(row, value)) return wrong_form(row);
  const bool is_choice = !row.choices.empty();
  if (is_choice && detail::place_of(row, value) == std::ssize(row.choices))
    return "must be " + domain_of(row) + did_you_mean(std::get<std::string>(value), row.choices);
  if (!in_range(row, value)) return "must be " + domain_of(row);
  if (row.form == Form::kAddress) return check_by<parse_stream_address>(value);
  return row.check != nullptr ? row.check(value) : Problem();
}

Value typed(const Row& row, std::string_view word) {
  return is_text(row) ? Value(std::string(word)) : parse_value(word);
}

}  // namespace cbcan::base

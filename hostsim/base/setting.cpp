// SPDX-License-Identifier: MIT
#include "base/setting.hpp"

#include <algorithm>
#include <cmath>

#include "base/address.hpp"
#include "base/text.hpp"

namespace cbcan::base {
namespace {

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

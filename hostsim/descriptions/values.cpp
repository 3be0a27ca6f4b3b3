// SPDX-License-Identifier: MIT
#include "descriptions/values.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "base/numbers.hpp"
#include "base/utf8.hpp"
#include "base/value.hpp"
#include "base/words.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan::descriptions {

namespace {

constexpr std::string_view kNodeId = "$NODEID";

constexpr std::array<std::string_view, 0x1C> kTypeNames = {"",
                                                           "BOOLEAN",
                                                           "INTEGER8",
                                                           "INTEGER16",
                                                           "INTEGER32",
                                                           "UNSIGNED8",
                                                           "UNSIGNED16",
                                                           "UNSIGNED32",
                                                           "REAL32",
                                                           "VISIBLE_STRING",
                                                           "OCTET_STRING",
                                                           "UNICODE_STRING",
                                                           "TIME_OF_DAY",
                                                           "TIME_DIFFERENCE",
                                                           "",
                                                           "DOMAIN",
                                                           "INTEGER24",
                                                           "REAL64",
                                                           "INTEGER40",
                                                           "INTEGER48",
                                                           "INTEGER56",
                                                           "INTEGER64",
                                                           "UNSIGNED24",
                                                           "",
                                                           "UNSIGNED40",
                                                           "UNSIGNED48",
                                                           "UNSIGNED56",
                                                           "UNSIGNED64"};

/// Some tools write integers as in C: 0x12345678UL.
std::string_view without_c_suffix(std::string_view text) {
  while (!text.empty() && std::string_view("uUlL").find(text.back()) != std::string_view::npos)
    text.remove_suffix(1);
  return text;
}

/// A part of a sum, without a sign.
std::optional<Number> parse_term(std::string_view text, std::uint8_t node_id) {
  if (text.starts_with('$'))
    return base::same_text(text, kNodeId) ? std::optional(Number{.magnitude = node_id, .node_ids = 1})
                                          : std::nullopt;
  text = without_c_suffix(text);
  Number number;
  int base = 10;
  if (base::has_hex_prefix(text)) {
    number.hexadecimal = true;
    base = 16;
    text.remove_prefix(2);
  } else if (text.size() > 1 && text.front() == '0') {
    number.no_octal = text.find_first_of("89") != std::string_view::npos;
    base = number.no_octal ? 10 : 8;
  }
  const auto magnitude = base::parse<std::uint64_t>(text, base);
  if (!magnitude) return std::nullopt;
  number.magnitude = *magnitude;
  return number;
}

/// Adds a term of a sum; false if the sum needs more than 64 bits.
bool add(Number& sum, const Number& term) {
  sum.hexadecimal |= term.hexadecimal;
  sum.node_ids += term.node_ids;
  sum.no_octal |= term.no_octal;
  sum.magnitude += term.magnitude;
  return sum.magnitude >= term.magnitude;
}

/// `magnitude` is the pattern of a negative number of the type, sign-extended to 32 or 64 bits.
bool is_sign_extended(std::uint64_t magnitude, std::uint64_t highest) {
  const std::uint64_t sign_and_above = ~(highest >> 1);
  if ((magnitude & sign_and_above) == sign_and_above) return true;
  const std::uint64_t above_32 = std::uint64_t{0xFFFFFFFF} << 32;
  return magnitude <= 0xFFFFFFFF && ((magnitude | above_32) & sign_and_above) == sign_and_above;
}

std::uint64_t highest_of(DataType type) {
  return type == DataType::kBoolean ? 1 : highest_pattern(size_of(type));
}

template <typename Real, typename Bits>
std::optional<std::uint64_t> parse_decimal_real(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto number = base::parse<Real>(text);
  return number ? std::optional<std::uint64_t>(std::bit_cast<Bits>(*number)) : std::nullopt;
}

void append_utf16(std::vector<std::uint8_t>& out, char32_t unit) {
  for (const std::uint8_t byte : to_bytes(unit, 2))
    out.push_back(byte);
}

}  // namespace

std::optional<Number> parse_number(std::string_view text, std::uint8_t node_id) {
  text = base::trim(text);
  Number sum;
  sum.negative = text.starts_with('-');
  if (sum.negative) text.remove_prefix(1);
  while (true) {
    const std::size_t plus = sum.negative ? std::string_view::npos : text.find('+');
    const std::optional<Number> term = parse_term(base::trim(text.substr(0, plus)), node_id);
    if (!term || !add(sum, *term)) return std::nullopt;
    if (plus == std::string_view::npos) break;
    text.remove_prefix(plus + 1);
  }
  if (sum.negative && sum.node_ids != 0) return std::nullopt;
  sum.negative = sum.negative && sum.magnitude != 0;
  return sum;
}

std::optional<std::uint64_t> parse_count(std::string_view text) {
  return base::has_hex_prefix(text) ? base::parse<std::uint64_t>(text.substr(2), 16)
                                    : base::parse<std::uint64_t>(text);
}

std::optional<std::uint64_t> to_bits(const Number& number, DataType type) {
  const std::uint64_t highest = highest_of(type);
  const std::uint64_t magnitude = number.magnitude;
  if (!is_signed(type)) {
    const bool fits = !number.negative && magnitude <= highest;
    return fits ? std::optional(magnitude) : std::nullopt;
  }
  const std::uint64_t highest_positive = highest >> 1;
  if (number.negative)
    return magnitude <= highest_positive + 1 ? std::optional((0 - magnitude) & highest) : std::nullopt;
  if (magnitude <= highest_positive) return magnitude;
  const bool twos_complement =
      number.hexadecimal && (magnitude <= highest || is_sign_extended(magnitude, highest));
  return twos_complement ? std::optional(magnitude & highest) : std::nullopt;
}

std::optional<std::vector<std::uint8_t>> to_bytes(const Number& number, DataType type) {
  const std::size_t size = size_of(type);
  const auto bits = size != 0 ? to_bits(number, type) : std::nullopt;
  return bits ? std::optional(to_bytes(*bits, size)) : std::nullopt;
}

std::string range_of(DataType type) {
  const std::uint64_t most = highest_of(type);
  return is_signed(type) ? fmt::format("-{}..{}", most / 2 + 1, most / 2) : fmt::format("0..{}", most);
}

std::optional<std::uint64_t> parse_real(std::string_view text, DataType type) {
  const bool wide = type == DataType::kReal64;
  if (!base::has_hex_prefix(text))
    return wide ? parse_decimal_real<double, std::uint64_t>(text)
                : parse_decimal_real<float, std::uint32_t>(text);
  const std::optional<std::uint64_t> bits = base::parse<std::uint64_t>(text.substr(2), 16);
  return bits && *bits <= highest_pattern(size_of(type)) ? bits : std::nullopt;
}

std::int64_t from_bits(std::uint64_t bits, DataType type) {
  return is_signed(type) ? sign_extend(bits, size_of(type)) : static_cast<std::int64_t>(bits);
}

std::vector<std::uint8_t> to_bytes(std::uint64_t bits, std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  store_little_endian(bytes, bits);
  return bytes;
}

std::optional<std::vector<std::uint8_t>> parse_octets(std::string_view text) {
  text = base::trim(text);
  if (base::has_hex_prefix(text)) text.remove_prefix(2);
  return text == "0" ? std::vector<std::uint8_t>() : base::parse_octets(text);
}

std::vector<std::uint8_t> to_utf16(std::string_view text) {
  const std::string utf8 = base::as_utf8(text);
  std::string_view rest = utf8;
  std::vector<std::uint8_t> out;
  while (const std::optional<char32_t> code = base::take_code_point(rest)) {
    if (*code < 0x10000) {
      append_utf16(out, *code);
    } else {
      append_utf16(out, 0xD800 + ((*code - 0x10000) >> 10));
      append_utf16(out, 0xDC00 + (*code & 0x3FF));
    }
  }
  return out;
}

bool is_real(DataType type) {
  return type == DataType::kReal32 || type == DataType::kReal64;
}

bool is_known(std::uint64_t type_index) {
  return type_index < kTypeNames.size() && !kTypeNames[static_cast<std::size_t>(type_index)].empty();
}

std::string_view name_of(DataType type) {
  const auto index = static_cast<std::size_t>(type);
  return is_known(index) ? kTypeNames[index] : std::string_view("unknown type");
}

}  // namespace cbcan::descriptions

// SPDX-License-Identifier: MIT
#include "descriptions/values.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>

#include "base/setting.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan::descriptions {

namespace {

constexpr std::string_view kNodeId = "$NODEID";

/// The types other than UNSIGNEDnn and INTEGERnn.
constexpr std::array kTypeNames{ValueType{"BOOLEAN", DataType::kBoolean},
                                ValueType{"REAL32", DataType::kReal32},
                                ValueType{"REAL64", DataType::kReal64},
                                ValueType{"VISIBLE_STRING", DataType::kVisibleString},
                                ValueType{"OCTET_STRING", DataType::kOctetString},
                                ValueType{"UNICODE_STRING", DataType::kUnicodeString},
                                ValueType{"TIME_OF_DAY", DataType::kTimeOfDay},
                                ValueType{"TIME_DIFFERENCE", DataType::kTimeDifference},
                                ValueType{"DOMAIN", DataType::kDomain}};

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

constexpr std::array kTypes{
    ValueType{"u8", DataType::kUnsigned8},   ValueType{"u16", DataType::kUnsigned16},
    ValueType{"u24", DataType::kUnsigned24}, ValueType{"u32", DataType::kUnsigned32},
    ValueType{"u40", DataType::kUnsigned40}, ValueType{"u48", DataType::kUnsigned48},
    ValueType{"u56", DataType::kUnsigned56}, ValueType{"u64", DataType::kUnsigned64},
    ValueType{"i8", DataType::kInteger8},    ValueType{"i16", DataType::kInteger16},
    ValueType{"i24", DataType::kInteger24},  ValueType{"i32", DataType::kInteger32},
    ValueType{"i40", DataType::kInteger40},  ValueType{"i48", DataType::kInteger48},
    ValueType{"i56", DataType::kInteger56},  ValueType{"i64", DataType::kInteger64},
    ValueType{"f32", DataType::kReal32},     ValueType{"f64", DataType::kReal64},
    ValueType{"bool", DataType::kBoolean},   ValueType{"string", DataType::kVisibleString},
    ValueType{"hex", DataType::kDomain},
};

/// Decimal, 0x.. or ..h, without a sign.
std::optional<std::uint64_t> magnitude(std::string_view text) {
  if (base::has_hex_prefix(text)) return base::parse<std::uint64_t>(text.substr(2), 16);
  if (text.ends_with('h') || text.ends_with('H'))
    return base::parse<std::uint64_t>(text.substr(0, text.size() - 1), 16);
  return base::parse<std::uint64_t>(text);
}

[[noreturn]] void refuse(std::string_view text, const ValueType& type, const std::string& why) {
  throw UsageError(fmt::format("'{}' is no {}: {}", text, type.name, why));
}

Bytes parse_hex(std::string_view text) {
  auto bytes = base::parse_hex(text);
  if (!bytes)
    throw UsageError(
        fmt::format("'{}' is no row of bytes; write pairs of hexadecimal digits, such as hex:01 02", text));
  return *std::move(bytes);
}

Bytes parse_integer(std::string_view text, const ValueType& type) {
  const bool negative = text.starts_with('-');
  const auto number = magnitude(negative ? text.substr(1) : text);
  if (!number) refuse(text, type, "write a decimal number, 0x12 or 12h");
  auto bytes = to_bytes({.magnitude = *number, .negative = negative && *number != 0}, type.type);
  if (!bytes) refuse(text, type, "its range is " + range_of(type.type));
  return *std::move(bytes);
}

Bytes parse_real(std::string_view text, const ValueType& type) {
  const auto bits = descriptions::parse_real(text, type.type);
  if (!bits) refuse(text, type, "write a number such as -1.5 or 2e3");
  return to_bytes(*bits, type.size());
}

Bytes parse_boolean(std::string_view text, const ValueType& type) {
  if (text == "true" || text == "1") return {1};
  if (text != "false" && text != "0") refuse(text, type, "write true or false");
  return {0};
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
  const auto type = static_cast<DataType>(type_index);
  return type_index <= 0xFF &&
         (size_of(type) != 0 || std::ranges::count(kTypeNames, type, &ValueType::type) != 0);
}

std::string name_of(DataType type) {
  const auto named = std::ranges::find(kTypeNames, type, &ValueType::type);
  if (named != kTypeNames.end()) return std::string(named->name);
  if (size_of(type) == 0) return "unknown type";
  return fmt::format("{}{}", is_signed(type) ? "INTEGER" : "UNSIGNED", 8 * size_of(type));
}

const std::span<const ValueType> kValueTypes = kTypes;

const ValueType& value_type(std::string_view name, std::string_view what) {
  for (const ValueType& type : kTypes)
    if (type.name == name) return type;
  throw UsageError(fmt::format("{} {}: no such type; there are {}", what, name,
                               base::listed(base::column(kTypes, &ValueType::name), ", ")));
}

unsigned parse_number(std::string_view text, unsigned most, const std::string& what) {
  const auto number = magnitude(text);
  if (!number) {
    const bool hexadecimal = base::parse<std::uint64_t>(text, 16).has_value();
    throw UsageError(fmt::format("{} {}: {}", what, text,
                                 hexadecimal ? fmt::format("hexadecimal is written 0x{0} or {0}h", text)
                                             : "write a decimal number, 0x12 or 12h"));
  }
  if (*number > most) throw UsageError(fmt::format("{} {}: the most is {}", what, text, most));
  return static_cast<unsigned>(*number);
}

Bytes parse_value(std::string_view text, const ValueType& type) {
  if (base::is_hex(text) || type.type == DataType::kDomain) return parse_hex(text);
  if (type.is_text()) return Bytes(text.begin(), text.end());
  if (type.type == DataType::kBoolean) return parse_boolean(text, type);
  return is_real(type.type) ? parse_real(text, type) : parse_integer(text, type);
}

std::string print_value(std::span<const std::uint8_t> bytes, const ValueType& type) {
  if (type.size() != 0 && bytes.size() != type.size())
    throw UsageError(fmt::format("the object has {} bytes, {} has {}: {}", bytes.size(), type.name,
                                 type.size(), base::hex(bytes, " ")));
  if (type.type == DataType::kDomain) return base::hex(bytes, " ");
  if (type.is_text()) return std::string(bytes.begin(), bytes.end());
  if (type.type == DataType::kBoolean) return bytes[0] != 0 ? "true" : "false";
  const std::uint64_t bits = load_little_endian(bytes);
  if (type.type == DataType::kReal64) return fmt::format("{}", std::bit_cast<double>(bits));
  if (type.type == DataType::kReal32)
    return fmt::format("{}", std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
  return is_signed(type.type) ? std::to_string(from_bits(bits, type.type)) : std::to_string(bits);
}

std::string print_value(std::span<const std::uint8_t> bytes) {
  const std::size_t size = bytes.size();
  if (size == 0) return "(empty)";
  if (size > 4 && size != 8) return base::hex(bytes, " ");
  const std::uint64_t number = load_little_endian(bytes);
  return fmt::format("0x{} {}", base::hex(number, static_cast<unsigned>(2 * size)), number);
}

std::string json_value(std::span<const std::uint8_t> bytes, const ValueType* type) {
  if (type == nullptr) {
    const bool is_number = !print_value(bytes).find("0x");
    return is_number ? std::to_string(load_little_endian(bytes)) : base::json_text(print_value(bytes));
  }
  const std::string value = print_value(bytes, *type);
  const bool is_infinite =
      is_real(type->type) && value.find_first_not_of("-+.e0123456789") != std::string::npos;
  return type->size() == 0 || is_infinite ? base::json_text(value) : value;
}

}  // namespace cbcan::descriptions

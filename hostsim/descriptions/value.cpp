// SPDX-License-Identifier: MIT
#include "descriptions/value.hpp"

#include <fmt/core.h>

#include <array>
#include <bit>

#include "base/numbers.hpp"
#include "base/value.hpp"
#include "base/words.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan::descriptions {

namespace {

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

std::span<const ValueType> value_types() {
  return kTypes;
}

const ValueType& value_type(std::string_view name) {
  for (const ValueType& type : kTypes)
    if (type.name == name) return type;
  std::vector<std::string_view> names;
  for (const ValueType& type : kTypes)
    names.push_back(type.name);
  throw UsageError(fmt::format("--type {}: no such type; there are {}", name, base::listed(names, ", ")));
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

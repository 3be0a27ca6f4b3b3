// SPDX-License-Identifier: MIT
#include "cbcanctl/value.hpp"

#include <fmt/core.h>

#include <array>
#include <bit>

#include "text/numbers.hpp"
#include "text/value.hpp"
#include "text/words.hpp"

namespace cbcan::tools {

namespace {

constexpr std::array kTypes{
    ValueType{"u8", Kind::kUnsigned, 1},  ValueType{"u16", Kind::kUnsigned, 2},
    ValueType{"u24", Kind::kUnsigned, 3}, ValueType{"u32", Kind::kUnsigned, 4},
    ValueType{"u40", Kind::kUnsigned, 5}, ValueType{"u48", Kind::kUnsigned, 6},
    ValueType{"u56", Kind::kUnsigned, 7}, ValueType{"u64", Kind::kUnsigned, 8},
    ValueType{"i8", Kind::kSigned, 1},    ValueType{"i16", Kind::kSigned, 2},
    ValueType{"i24", Kind::kSigned, 3},   ValueType{"i32", Kind::kSigned, 4},
    ValueType{"i40", Kind::kSigned, 5},   ValueType{"i48", Kind::kSigned, 6},
    ValueType{"i56", Kind::kSigned, 7},   ValueType{"i64", Kind::kSigned, 8},
    ValueType{"f32", Kind::kReal, 4},     ValueType{"f64", Kind::kReal, 8},
    ValueType{"bool", Kind::kBoolean, 1}, ValueType{"string", Kind::kString, 0},
    ValueType{"hex", Kind::kHex, 0},
};

/// Decimal, 0x.. or ..h, without a sign.
std::optional<std::uint64_t> magnitude(std::string_view text) {
  if (text::has_hex_prefix(text)) return text::parse<std::uint64_t>(text.substr(2), 16);
  if (text.ends_with('h') || text.ends_with('H'))
    return text::parse<std::uint64_t>(text.substr(0, text.size() - 1), 16);
  return text::parse<std::uint64_t>(text);
}

std::uint64_t mask_of(std::size_t size) {
  return size == 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * size) - 1;
}

Bytes little_endian(std::uint64_t number, std::size_t size) {
  Bytes bytes(size);
  for (std::uint8_t& byte : bytes) {
    byte = static_cast<std::uint8_t>(number);
    number >>= 8;
  }
  return bytes;
}

std::uint64_t from_little_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t number = 0;
  for (std::size_t i = bytes.size(); i-- > 0;)
    number = number << 8 | bytes[i];
  return number;
}

[[noreturn]] void refuse(std::string_view text, const ValueType& type, const std::string& why) {
  throw UsageError(fmt::format("'{}' is no {}: {}", text, type.name, why));
}

Bytes parse_hex(std::string_view text) {
  auto bytes = text::parse_hex(text);
  if (!bytes)
    throw UsageError(
        fmt::format("'{}' is no row of bytes; write pairs of hexadecimal digits, such as hex:01 02", text));
  return *std::move(bytes);
}

Bytes parse_integer(std::string_view text, const ValueType& type) {
  const bool negative = text.starts_with('-');
  const auto number = magnitude(negative ? text.substr(1) : text);
  if (!number) refuse(text, type, "write a decimal number, 0x12 or 12h");
  const bool is_signed = type.kind == Kind::kSigned;
  const std::uint64_t half = std::uint64_t{1} << (8 * type.size - 1);
  const std::uint64_t most = is_signed ? (negative ? half : half - 1) : mask_of(type.size);
  if ((negative && !is_signed && *number != 0) || *number > most)
    refuse(text, type,
           is_signed ? fmt::format("its range is -{}..{}", half, half - 1)
                     : fmt::format("its range is 0..{}", mask_of(type.size)));
  return little_endian(negative ? 0 - *number : *number, type.size);
}

Bytes parse_real(std::string_view text, const ValueType& type) {
  const auto number = text::parse<double>(text);
  if (!number) return refuse(text, type, "write a number such as -1.5 or 2e3"), Bytes{};
  if (type.size == 8) return little_endian(std::bit_cast<std::uint64_t>(*number), 8);
  return little_endian(std::bit_cast<std::uint32_t>(static_cast<float>(*number)), 4);
}

Bytes parse_boolean(std::string_view text, const ValueType& type) {
  if (text == "true" || text == "1") return {1};
  if (text != "false" && text != "0") refuse(text, type, "write true or false");
  return {0};
}

std::string print_signed(std::span<const std::uint8_t> bytes) {
  const auto shift = static_cast<unsigned>(64 - 8 * bytes.size());
  return std::to_string(static_cast<std::int64_t>(from_little_endian(bytes) << shift) >> shift);
}

std::string print_real(std::span<const std::uint8_t> bytes) {
  const std::uint64_t bits = from_little_endian(bytes);
  if (bytes.size() == 8) return fmt::format("{}", std::bit_cast<double>(bits));
  return fmt::format("{}", std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
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
  throw UsageError(fmt::format("--type {}: no such type; there are {}", name, text::listed(names, ", ")));
}

std::uint64_t parse_number(std::string_view text, std::uint64_t most, const std::string& what) {
  const auto number = magnitude(text);
  if (!number) {
    const bool hexadecimal = text::parse<std::uint64_t>(text, 16).has_value();
    throw UsageError(fmt::format("{} {}: {}", what, text,
                                 hexadecimal ? fmt::format("hexadecimal is written 0x{0} or {0}h", text)
                                             : "write a decimal number, 0x12 or 12h"));
  }
  if (*number > most) throw UsageError(fmt::format("{} {}: the most is {}", what, text, most));
  return *number;
}

Bytes parse_value(std::string_view text, const ValueType& type) {
  if (text::is_hex(text)) return parse_hex(text);
  switch (type.kind) {
    case Kind::kUnsigned:
    case Kind::kSigned: return parse_integer(text, type);
    case Kind::kReal: return parse_real(text, type);
    case Kind::kBoolean: return parse_boolean(text, type);
    case Kind::kString: return Bytes(text.begin(), text.end());
    case Kind::kHex: return parse_hex(text);
  }
  return {};
}

std::string print_value(std::span<const std::uint8_t> bytes, const ValueType& type) {
  if (type.size != 0 && bytes.size() != type.size)
    throw UsageError(fmt::format("the object has {} bytes, {} has {}: {}", bytes.size(), type.name, type.size,
                                 text::hex(bytes, " ")));
  switch (type.kind) {
    case Kind::kUnsigned: return std::to_string(from_little_endian(bytes));
    case Kind::kSigned: return print_signed(bytes);
    case Kind::kReal: return print_real(bytes);
    case Kind::kBoolean: return bytes[0] != 0 ? "true" : "false";
    case Kind::kString: return std::string(bytes.begin(), bytes.end());
    case Kind::kHex: return text::hex(bytes, " ");
  }
  return {};
}

std::string print_value(std::span<const std::uint8_t> bytes) {
  const std::size_t size = bytes.size();
  if (size == 0) return "(empty)";
  if (size > 4 && size != 8) return text::hex(bytes, " ");
  const std::uint64_t number = from_little_endian(bytes);
  return fmt::format("0x{} {}", text::hex(number, static_cast<unsigned>(2 * size)), number);
}

std::string json_value(std::span<const std::uint8_t> bytes, const ValueType* type) {
  if (type == nullptr) {
    const bool is_number = !print_value(bytes).find("0x");
    return is_number ? std::to_string(from_little_endian(bytes)) : json_string(print_value(bytes));
  }
  const std::string value = print_value(bytes, *type);
  const bool is_text = type->kind == Kind::kString || type->kind == Kind::kHex;
  const bool is_finite =
      type->kind != Kind::kReal || value.find_first_not_of("-+.e0123456789") == std::string::npos;
  return is_text || !is_finite ? json_string(value) : value;
}

std::string json_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte > 0x7E) {
      out += fmt::format("\\u{:04X}", byte);
    } else {
      out += c;
    }
  }
  return out + "\"";
}

}  // namespace cbcan::tools

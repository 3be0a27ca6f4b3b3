// SPDX-License-Identifier: MIT
#include "cbcanctl/value.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>

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

constexpr std::string_view kHexPrefix = "hex:";

template <class Number, class... Base>
std::optional<Number> whole(std::string_view text, Base... base) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base...);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Decimal, 0x.. or ..h, without a sign.
std::optional<std::uint64_t> magnitude(std::string_view text) {
  if (text.starts_with("0x") || text.starts_with("0X")) return whole<std::uint64_t>(text.substr(2), 16);
  if (text.ends_with('h') || text.ends_with('H'))
    return whole<std::uint64_t>(text.substr(0, text.size() - 1), 16);
  return whole<std::uint64_t>(text);
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
  throw UsageError("'" + std::string(text) + "' is no " + std::string(type.name) + ": " + why);
}

Bytes parse_hex(std::string_view text) {
  std::string digits;
  for (const char c : text)
    if (c != ' ') digits += c;
  Bytes bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    const auto byte = whole<std::uint8_t>(std::string_view(digits).substr(i, 2), 16);
    if (!byte || i + 2 > digits.size())
      throw UsageError("'" + std::string(text) +
                       "' is no row of bytes; write pairs of hexadecimal digits, such as hex:01 02");
    bytes.push_back(*byte);
  }
  return bytes;
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
           is_signed ? "its range is -" + std::to_string(half) + ".." + std::to_string(half - 1)
                     : "its range is 0.." + std::to_string(mask_of(type.size)));
  return little_endian(negative ? 0 - *number : *number, type.size);
}

Bytes parse_real(std::string_view text, const ValueType& type) {
  const auto number = whole<double>(text);
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
  std::array<char, 64> text{};
  const std::uint64_t bits = from_little_endian(bytes);
  const auto end =
      bytes.size() == 8
          ? std::to_chars(text.data(), text.data() + text.size(), std::bit_cast<double>(bits)).ptr
          : std::to_chars(text.data(), text.data() + text.size(),
                          std::bit_cast<float>(static_cast<std::uint32_t>(bits)))
                .ptr;
  return std::string(text.data(), end);
}

}  // namespace

std::span<const ValueType> value_types() {
  return kTypes;
}

const ValueType& value_type(std::string_view name) {
  for (const ValueType& type : kTypes)
    if (type.name == name) return type;
  std::string names;
  for (const ValueType& type : kTypes)
    names += (names.empty() ? "" : ", ") + std::string(type.name);
  throw UsageError("--type " + std::string(name) + ": no such type; there are " + names);
}

std::uint64_t parse_number(std::string_view text, std::uint64_t most, const std::string& what) {
  const auto number = magnitude(text);
  if (!number) {
    const bool hexadecimal = whole<std::uint64_t>(text, 16).has_value();
    throw UsageError(what + " " + std::string(text) + ": " +
                     (hexadecimal
                          ? "hexadecimal is written 0x" + std::string(text) + " or " + std::string(text) + "h"
                          : "write a decimal number, 0x12 or 12h"));
  }
  if (*number > most)
    throw UsageError(what + " " + std::string(text) + ": the most is " + std::to_string(most));
  return *number;
}

Bytes parse_value(std::string_view text, const ValueType& type) {
  if (text.starts_with(kHexPrefix)) return parse_hex(text.substr(kHexPrefix.size()));
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
    throw UsageError("the object has " + std::to_string(bytes.size()) + " bytes, " + std::string(type.name) +
                     " has " + std::to_string(type.size) + ": " + hex_dump(bytes));
  switch (type.kind) {
    case Kind::kUnsigned: return std::to_string(from_little_endian(bytes));
    case Kind::kSigned: return print_signed(bytes);
    case Kind::kReal: return print_real(bytes);
    case Kind::kBoolean: return bytes[0] != 0 ? "true" : "false";
    case Kind::kString: return std::string(bytes.begin(), bytes.end());
    case Kind::kHex: return hex_dump(bytes);
  }
  return {};
}

std::string print_value(std::span<const std::uint8_t> bytes) {
  const std::size_t size = bytes.size();
  if (size == 0) return "(empty)";
  if (size > 4 && size != 8) return hex_dump(bytes);
  const std::uint64_t number = from_little_endian(bytes);
  std::array<char, 24> hex{};
  std::snprintf(hex.data(), hex.size(), "0x%0*llX", static_cast<int>(2 * size),
                static_cast<unsigned long long>(number));
  return std::string(hex.data()) + " " + std::to_string(number);
}

std::string hex_dump(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    std::array<char, 4> pair{};
    std::snprintf(pair.data(), pair.size(), "%02X", byte);
    text += (text.empty() ? "" : " ") + std::string(pair.data());
  }
  return text;
}

std::string json_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte > 0x7E) {
      std::array<char, 8> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04X", byte);
      out += escape.data();
    } else {
      out += c;
    }
  }
  return out + "\"";
}

}  // namespace cbcan::tools

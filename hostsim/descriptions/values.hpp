// SPDX-License-Identifier: MIT
#pragma once

/// Values as an EDS writes them (CiA 306, 4.2), converted to bytes on the bus (CiA 301, 7.1.4.3). Pure
/// functions; the caller reports what is wrong and in which line.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "base/text.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"

namespace cbcan::descriptions {

/// An integer as it was written: 258, -3, 0x1A, 017 (octal), $NODEID+0x180, 0x180 + $nodeid.
struct Number {
  std::uint64_t magnitude = 0;
  bool negative = false;
  bool hexadecimal = false;    ///< may be a two's complement
  std::uint32_t node_ids = 0;  ///< how often $NODEID is in it
  bool no_octal = false;  ///< starts with 0 as an octal number does, but has an 8 or a 9: read as decimal
};

/// `node_id` is the value of $NODEID. nullopt if the text is no number or needs more than 64 bits.
std::optional<Number> parse_number(std::string_view text, std::uint8_t node_id);

/// The same, faster, for "12" and "0x1F", as most values are; nullopt for any other text.
inline std::optional<Number> parse_plain(std::string_view text) {
  constexpr std::size_t kMostDigits = 15;  // in 64 bits, in any case
  Number number{.hexadecimal = base::has_hex_prefix(text)};
  if (number.hexadecimal) text.remove_prefix(2);
  const bool is_octal = !number.hexadecimal && text.size() > 1 && text.front() == '0';
  bool good = !text.empty() && text.size() <= kMostDigits && !is_octal;
  const unsigned base = number.hexadecimal ? 16 : 10;
  for (std::size_t i = 0; good && i < text.size(); ++i) {
    unsigned digit = static_cast<unsigned char>(text[i]) - unsigned{'0'};
    if (digit >= 10) {
      const unsigned letter = (static_cast<unsigned char>(text[i]) | 0x20U) - unsigned{'a'};
      digit = letter < 6 ? letter + 10 : 16;
    }
    good = digit < base;
    number.magnitude = number.magnitude * base + digit;
  }
  return good ? std::optional(number) : std::nullopt;
}

/// Parses like parse_number, for sub-indices, counts and positions in key names: decimal or 0x, no sign, no
/// octal.
std::optional<std::uint64_t> parse_count(std::string_view text);

/// All bits of a number of this size.
constexpr std::uint64_t highest_pattern(std::size_t bytes) {
  return bytes >= 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * bytes) - 1;
}

/// The number as a bit pattern of the type's size; nullopt if it does not fit. INTEGER8, for example, accepts
/// -128, 0x80 and 0xFFFFFF80, which some tools write. Only for types that have a size and are not REAL.
std::optional<std::uint64_t> to_bits(const Number& number, DataType type);

/// The same as bytes; nullopt also for a type without a size.
std::optional<std::vector<std::uint8_t>> to_bytes(const Number& number, DataType type);

/// "-128..127", of an integer or BOOLEAN.
std::string range_of(DataType type);

/// REAL32 and REAL64: `1.5`, `-2e3`, or a bit pattern in hexadecimal, `0x3FC00000`.
std::optional<std::uint64_t> parse_real(std::string_view text, DataType type);

/// The number for a bit pattern of the type's size: sign-extended for INTEGERnn, else the pattern itself.
std::int64_t from_bits(std::uint64_t bits, DataType type);

/// The low `size` bytes, little-endian.
std::vector<std::uint8_t> to_bytes(std::uint64_t bits, std::size_t size);

/// OCTET_STRING and DOMAIN: pairs of hexadecimal digits, with or without blanks between the pairs or 0x in
/// front. A lone 0, which tools write for an empty value, is empty.
std::optional<std::vector<std::uint8_t>> parse_octets(std::string_view text);

/// UNICODE_STRING: UTF-16, little-endian, from UTF-8 or else from Latin-1.
std::vector<std::uint8_t> to_utf16(std::string_view text);

bool is_real(DataType type);

/// The index is that of a type of CiA 301 in DataType.
bool is_known(std::uint64_t type_index);

/// The name as CiA 301 writes it: "UNSIGNED8".
std::string name_of(DataType type);

// ---- Values as text, and as little-endian bytes in the data words

using Bytes = std::vector<std::uint8_t>;

/// Bytes of an object that the module writes to a node; cbcanctl configure writes fewer.
inline constexpr std::size_t kMostValueToWrite = 65'000;

using base::UsageError;

/// A type of --type; "hex" is a DOMAIN.
struct ValueType {
  std::string_view name;
  DataType type;

  bool is_text() const { return type == DataType::kVisibleString; }
  std::size_t size() const { return size_of(type); }  ///< bytes; 0 = any number
};

/// "u8".."u64" and "i8".."i64" in steps of 8 bits, "f32", "f64", "bool", "string", "hex".
extern const std::span<const ValueType> kValueTypes;

/// Throws UsageError for an unknown name; `what` begins its text.
const ValueType& value_type(std::string_view name, std::string_view what = "--type");

/// A number from 0 to `most`: decimal, 0x.., or hexadecimal digits and a trailing h. `what`: its name in the
/// error message.
unsigned parse_number(std::string_view text, unsigned most, const std::string& what);

/// Throws UsageError if the text is not such a value or does not fit. `hex:01 02` means bytes for any type.
Bytes parse_value(std::string_view text, const ValueType& type);

/// The bytes as a value of the type; throws UsageError if the number of bytes is wrong.
std::string print_value(std::span<const std::uint8_t> bytes, const ValueType& type);

/// Prints values without a type: 1, 2, 3, 4 and 8 bytes as an unsigned number, hexadecimal and decimal; else
/// the bytes.
std::string print_value(std::span<const std::uint8_t> bytes);

/// Prints JSON: numbers as numbers, except those that JSON does not have, such as infinity. `type` may be
/// null.
std::string json_value(std::span<const std::uint8_t> bytes, const ValueType* type);

}  // namespace cbcan::descriptions

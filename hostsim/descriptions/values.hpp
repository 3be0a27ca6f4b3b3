// SPDX-License-Identifier: MIT
#pragma once

/// Values as an EDS writes them (CiA 306, 4.2), converted to bytes on the bus (CiA 301, 7.1.4.3). Pure
/// functions; the caller reports what is wrong and in which line.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/numbers.hpp"
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
std::string_view name_of(DataType type);

}  // namespace cbcan::descriptions

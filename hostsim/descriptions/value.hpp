// SPDX-License-Identifier: MIT
#pragma once

/// Values as text, and as little-endian bytes in the data words.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "descriptions/values.hpp"

namespace cbcan::descriptions {

using Bytes = std::vector<std::uint8_t>;

using base::UsageError;

/// A type of --type; "hex" is a DOMAIN.
struct ValueType {
  std::string_view name;
  DataType type;

  bool is_text() const { return type == DataType::kVisibleString; }
  std::size_t size() const { return size_of(type); }  ///< bytes; 0 = any number
};

/// "u8".."u64" and "i8".."i64" in steps of 8 bits, "f32", "f64", "bool", "string", "hex".
std::span<const ValueType> value_types();

/// Throws UsageError for an unknown name.
const ValueType& value_type(std::string_view name);

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

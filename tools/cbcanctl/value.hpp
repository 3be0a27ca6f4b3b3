// SPDX-License-Identifier: MIT
#pragma once

/// Values as a person types and reads them, and as they lie in the data words: little-endian bytes.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "eds/values.hpp"
#include "text/error.hpp"

namespace cbcan::tools {

using Bytes = std::vector<std::uint8_t>;

using text::UsageError;

/// A type of --type; "hex" is a DOMAIN.
struct ValueType {
  std::string_view name;
  DataType type;

  bool is_text() const { return type == DataType::kVisibleString; }
  std::size_t size() const { return size_of(type); }  ///< bytes; 0 = as many as there are
};

/// "u8".."u64" and "i8".."i64" in steps of 8 bits, "f32", "f64", "bool", "string", "hex".
std::span<const ValueType> value_types();

/// Throws UsageError for a name that is none.
const ValueType& value_type(std::string_view name);

/// A number from 0 to `most`: decimal, 0x.., or hexadecimal digits and a trailing h. `what` names it in the
/// error.
unsigned parse_number(std::string_view text, unsigned most, const std::string& what);

/// Throws UsageError where the text is no such value or does not fit. `hex:01 02` is bytes whatever the type.
Bytes parse_value(std::string_view text, const ValueType& type);

/// The bytes as a value of the type; throws UsageError if there are too many or too few of them for it.
std::string print_value(std::span<const std::uint8_t> bytes, const ValueType& type);

/// Without a type: 1, 2, 3, 4 and 8 bytes as an unsigned number in both notations, else the bytes.
std::string print_value(std::span<const std::uint8_t> bytes);

/// Likewise as JSON: numbers as numbers, but those that JSON has not. A null type is none.
std::string json_value(std::span<const std::uint8_t> bytes, const ValueType* type);

/// A JSON string literal; bytes that are not printable ASCII become \u00XX.
std::string json_string(std::string_view text);

}  // namespace cbcan::tools

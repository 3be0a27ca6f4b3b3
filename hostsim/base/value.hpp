// SPDX-License-Identifier: MIT
#pragma once

/// A value as a user writes it, before the data type is known.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/buffer.hpp"

namespace cbcan::base {

using Bytes = std::vector<std::uint8_t>;
using Value = std::variant<bool, std::int64_t, double, std::string, Bytes>;

/// Pairs of hexadecimal digits, with or without blanks between them; nullopt if they are no pairs.
std::optional<Bytes> parse_octets(std::string_view text);
/// "hex:01 02 aB" and "0102aB" are three bytes, "hex:" is none; nullopt if the digits are not pairs.
std::optional<Bytes> parse_hex(std::string_view text);
bool is_hex(std::string_view text);

/// A value without its type: true or false, an integer, a number with a point or an exponent, else a text. A
/// text that looks like one of the others must be in double quotes.
Value parse_value(std::string_view text);

/// A text in TOML, as UTF-8.
std::string toml_text(std::string_view text);
/// Text in JSON: a byte outside printable ASCII becomes \u00XX.
std::string json_text(std::string_view text);

/// The value as a plant file writes it; texts and bytes in double quotes.
void append_value(Buffer& to, std::span<const std::uint8_t> bytes);
std::string value_text(const Value& value);

}  // namespace cbcan::base

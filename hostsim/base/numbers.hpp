// SPDX-License-Identifier: MIT
#pragma once

/// Numbers from text and back: the only place that uses std::from_chars.

#include <charconv>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

namespace cbcan::base {

/// All of `text` as a number of this type, an integer in `base`; nullopt if it is none or does not fit. The only
/// sign is the minus; no prefix, no blanks.
template <class Number, class... Base>
std::optional<Number> parse(std::string_view text, Base... base) {
  Number number{};
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, number, base...);
  if (text.empty() || error != std::errc{} || stopped != end) return std::nullopt;
  return number;
}

constexpr bool has_hex_prefix(std::string_view text) {
  return text.starts_with("0x") || text.starts_with("0X");
}

/// "12", "-5", "0x1017", "1017h", "0FFh"; the text must contain nothing else.
std::optional<std::int64_t> parse_integer(std::string_view text);

/// "12.345678": seconds.
std::string seconds_text(std::uint64_t microseconds);

/// "100ms": a whole number of us, ms or s, at most a year. Returns microseconds.
std::optional<std::uint64_t> parse_duration(std::string_view text);

/// Upper-case hexadecimal digits, this many or more.
std::string hex(std::uint64_t number, unsigned digits);

/// "0A 1B": two upper-case digits for each byte.
std::string hex(std::span<const std::uint8_t> bytes, std::string_view between);

/// "3700 1 65535"
std::string joined(std::span<const std::uint16_t> numbers);

}  // namespace cbcan::base

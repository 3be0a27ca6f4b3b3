// SPDX-License-Identifier: MIT
#include "base/numbers.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "base/buffer.hpp"

namespace cbcan::base {

std::optional<std::int64_t> parse_integer(std::string_view text) {
  const bool prefixed = has_hex_prefix(text);
  const bool suffixed = !prefixed && text.size() > 1 && text.front() >= '0' && text.front() <= '9' &&
                        (text.back() == 'h' || text.back() == 'H');
  if (!prefixed && !suffixed) return parse<std::int64_t>(text);
  if (prefixed)
    text.remove_prefix(2);
  else
    text.remove_suffix(1);
  return text.starts_with('-') ? std::nullopt : parse<std::int64_t>(text, 16);
}

std::string seconds_text(std::uint64_t microseconds) {
  return made([&](Buffer& to) { append(to, Seconds{microseconds}); });
}

std::optional<std::uint64_t> parse_duration(std::string_view text) {
  constexpr std::uint64_t kMost = 365ULL * 24 * 3600 * 1'000'000;
  const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  const auto count = parse<std::uint64_t>(text.substr(0, digits));
  const std::string_view unit = text.substr(digits);
  const std::uint64_t scale = unit == "us" ? 1 : unit == "ms" ? 1000 : unit == "s" ? 1'000'000 : 0;
  if (!count || scale == 0 || *count > kMost / scale) return std::nullopt;
  return *count * scale;
}

std::string hex(std::uint64_t number, unsigned digits) {
  return made([&](Buffer& to) { append(to, Hex{number, digits}); });
}

std::string hex(std::span<const std::uint8_t> bytes, std::string_view between) {
  return made([&](Buffer& to) { append(to, HexBytes{bytes, between}); });
}

std::string joined(std::span<const std::uint16_t> numbers) {
  return fmt::format("{}", fmt::join(numbers, " "));
}

}  // namespace cbcan::base

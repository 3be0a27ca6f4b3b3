// SPDX-License-Identifier: MIT
#include "text/numbers.hpp"

#include <fmt/format.h>

namespace cbcan::text {

bool has_hex_prefix(std::string_view text) {
  return text.starts_with("0x") || text.starts_with("0X");
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
  if (!has_hex_prefix(text)) return parse<std::int64_t>(text);
  text.remove_prefix(2);
  return text.starts_with('-') ? std::nullopt : parse<std::int64_t>(text, 16);
}

std::string hex(std::uint64_t number, unsigned digits) {
  return fmt::format("{:0{}X}", number, digits);
}

}  // namespace cbcan::text

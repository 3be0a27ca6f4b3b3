// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace cbcan::io::test {

using Bytes = std::vector<std::uint8_t>;

inline unsigned hex_digit(char digit) {
  const std::size_t value = std::string_view("0123456789ABCDEF").find(digit);
  if (value == std::string_view::npos) throw std::invalid_argument("not a hexadecimal digit");
  return static_cast<unsigned>(value);
}

/// Bytes from hexadecimal digits: "00 1F" gives two.
inline Bytes hex(std::string_view text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] == ' ') continue;
    bytes.push_back(static_cast<std::uint8_t>(hex_digit(text[i]) << 4 | hex_digit(text[i + 1])));
    ++i;
  }
  return bytes;
}

}  // namespace cbcan::io::test

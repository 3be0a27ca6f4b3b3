// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cbcan::io::test {

using Bytes = std::vector<std::uint8_t>;

/// Bytes from hexadecimal digits: "00 1F" gives two.
inline Bytes hex(std::string_view text) {
  std::string digits(text);
  std::erase(digits, ' ');
  if (digits.find_first_not_of("0123456789ABCDEF") != std::string::npos)
    throw std::invalid_argument("not a hexadecimal digit");
  Bytes bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

}  // namespace cbcan::io::test

// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace cbcan::test {

/// "0102AB"
template <class Bytes>
std::string hex_of(const Bytes& bytes) {
  std::string text;
  for (const unsigned byte : bytes) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02X", byte & 0xFF);
    text += digits;
  }
  return text;
}

/// Low byte first.
inline std::string hex_of(std::uint64_t number, std::size_t bytes) {
  std::vector<std::uint8_t> low_first;
  for (; low_first.size() < bytes; number >>= 8)
    low_first.push_back(static_cast<std::uint8_t>(number));
  return hex_of(low_first);
}

}  // namespace cbcan::test

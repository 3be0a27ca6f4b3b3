// SPDX-License-Identifier: MIT
#pragma once

/// The CRC of Modbus RTU (Serial Line V1.02, 2.5.1.2): x^16 + x^15 + x^2 + 1, reflected, start value FFFFh.
/// Over a frame and its CRC, low byte first, it is 0.

#include <array>
#include <cstddef>
#include <cstdint>

namespace cbcan {

inline constexpr std::uint16_t kCrcStart = 0xFFFF;

/// Four bits at a time: 32 bytes of flash instead of 512, for five more instructions per byte.
inline constexpr std::array<std::uint16_t, 16> kCrcTable = [] {
  constexpr std::size_t kPolynomial = 0xA001;
  std::array<std::uint16_t, 16> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    std::size_t value = i;
    for (int bit = 0; bit < 4; ++bit)
      value = (value & 1) != 0 ? value >> 1 ^ kPolynomial : value >> 1;
    table[i] = static_cast<std::uint16_t>(value);
  }
  return table;
}();

inline std::uint16_t crc_with(std::uint16_t crc, std::uint8_t byte) {
  std::uint32_t value = crc ^ std::uint32_t{byte};
  value = value >> 4 ^ kCrcTable[value & 0xF];
  value = value >> 4 ^ kCrcTable[value & 0xF];
  return static_cast<std::uint16_t>(value);
}

/// The inverse: the CRC before this byte, from the one after it.
inline std::uint16_t crc_before(std::uint16_t crc, std::uint8_t byte) {
  std::uint32_t value = crc;
  for (int bit = 0; bit < 8; ++bit)
    value = (value & 0x8000) != 0 ? (value ^ 0xA001) << 1 | 1 : value << 1;
  return static_cast<std::uint16_t>(value ^ byte);
}

}  // namespace cbcan

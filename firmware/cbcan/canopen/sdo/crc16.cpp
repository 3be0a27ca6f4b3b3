// SPDX-License-Identifier: MIT
#include "cbcan/canopen/sdo/crc16.hpp"

namespace cbcan {

namespace {

/// value * x^16 modulo P = x^16 + x^12 + x^5 + 1, without a table: four bytes cost less than two lookups do.
///
/// The quotient q is value / (1 + a) with a = x^-4 + x^-11 + x^-16, and in GF(2) 1 / (1 + a) is the product
/// of (1 + a), (1 + a^2), (1 + a^4), ..., where a^2 = x^-8 + x^-22 + x^-32 and a^4 = x^-16 + ...; what would
/// be shifted by 32 and more is gone. The remainder is the lower half of q * P.
constexpr std::uint16_t remainder(std::uint32_t value) {
  std::uint32_t quotient = value;
  quotient ^= quotient >> 4 ^ quotient >> 11 ^ quotient >> 16;
  quotient ^= quotient >> 8 ^ quotient >> 22;
  quotient ^= quotient >> 16;
  return static_cast<std::uint16_t>(quotient ^ quotient << 5 ^ quotient << 12);
}

constexpr std::uint32_t load_big_endian(const std::uint8_t* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0;
  const std::uint8_t* next = bytes.data();
  const std::uint8_t* const end = next + bytes.size();
  for (; end - next >= 4; next += 4)
    crc = remainder(crc << 16 ^ load_big_endian(next));
  for (; next != end; ++next)
    crc = (crc << 8 & 0xFFFF) ^ remainder(crc >> 8 ^ *next);
  return static_cast<std::uint16_t>(crc);
}

}  // namespace cbcan

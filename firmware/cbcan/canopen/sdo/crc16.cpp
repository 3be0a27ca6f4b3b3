// SPDX-License-Identifier: MIT
#include "cbcan/canopen/sdo/crc16.hpp"

#include <cstddef>

namespace cbcan {

namespace {

/// Processes as many bytes at a time as a register has.
using Word = std::size_t;
constexpr unsigned kBits = 8 * sizeof(Word);

/// A shift by all bits or more gives 0.
constexpr Word right(Word value, unsigned bits) {
  return bits < kBits ? value >> bits % kBits : 0;
}

/// value * x^16 modulo P = x^16 + x^12 + x^5 + 1, without a table: a word costs less than two table lookups.
///
/// The quotient q is value / (1 + a) with a = x^-4 + x^-11 + x^-16, and in GF(2) 1 / (1 + a) is the product
/// of (1 + a), (1 + a^2), (1 + a^4), (1 + a^8), ..., where a^2 = x^-8 + x^-22 + x^-32 and so on. The
/// remainder is the lower half of q * P.
constexpr std::uint16_t remainder(Word value) {
  Word quotient = value;
  quotient ^= quotient >> 4 ^ quotient >> 11 ^ quotient >> 16;
  quotient ^= quotient >> 8 ^ quotient >> 22 ^ right(quotient, 32);
  quotient ^= quotient >> 16 ^ right(quotient, 44);
  quotient ^= right(quotient, 32);
  return static_cast<std::uint16_t>(quotient ^ quotient << 5 ^ quotient << 12);
}

constexpr Word load_big_endian(const std::uint8_t* bytes) {
  Word value = 0;
  for (std::size_t i = 0; i < sizeof(Word); i += 4)
    value = value << (kBits - 32) | std::uint32_t{bytes[i]} << 24 | std::uint32_t{bytes[i + 1]} << 16 |
            std::uint32_t{bytes[i + 2]} << 8 | bytes[i + 3];
  return value;
}

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  Word crc = 0;
  const std::uint8_t* next = bytes.data();
  const std::uint8_t* const end = next + bytes.size();
  for (; end - next >= static_cast<std::ptrdiff_t>(sizeof(Word)); next += sizeof(Word))
    crc = remainder(crc << (kBits - 16) ^ load_big_endian(next));
  for (; next != end; ++next)
    crc = (crc << 8 & 0xFFFF) ^ remainder(crc >> 8 ^ *next);
  return static_cast<std::uint16_t>(crc);
}

std::uint16_t crc16(std::uint16_t crc, std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes)
    crc = static_cast<std::uint16_t>((crc << 8 & 0xFFFF) ^ remainder(Word{crc} >> 8 ^ byte));
  return crc;
}

}  // namespace cbcan

// SPDX-License-Identifier: MIT
#pragma once

/// Numbers as CANopen transfers them on the bus and as the dictionary stores them: low byte first (CiA 301,
/// 7.1.4).

#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan {

/// A number of four bytes: one load, which is shorter than a call.
[[gnu::always_inline]] constexpr std::uint32_t load_word(const std::uint8_t* bytes) {
  return bytes[0] | std::uint32_t{bytes[1]} << 8 | std::uint32_t{bytes[2]} << 16 |
         std::uint32_t{bytes[3]} << 24;
}

/// Loads eight bytes or fewer; usually four.
constexpr std::uint64_t load_little_endian(std::span<const std::uint8_t> bytes) {
  if (bytes.size() == 4) return load_word(bytes.data());
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;)
    value = value << 8 | bytes[i];
  return value;
}

constexpr void store_little_endian(std::span<std::uint8_t> bytes, std::uint64_t value) {
  for (std::uint8_t& byte : bytes) {
    byte = static_cast<std::uint8_t>(value);
    value >>= 8;
  }
}

/// Sets bit 0..7 of a byte to `value`.
constexpr void assign_bit(std::uint8_t& byte, std::size_t bit, bool value) {
  const unsigned mask = 1u << bit;
  byte = static_cast<std::uint8_t>((byte & ~mask) | (value ? mask : 0u));
}

/// The number that the lowest `bytes` bytes of `value` are in two's complement; 1..8.
constexpr std::int64_t sign_extend(std::uint64_t value, std::size_t bytes) {
  const auto shift = static_cast<unsigned>(64 - 8 * bytes);
  return static_cast<std::int64_t>(value << shift) >> shift;
}

}  // namespace cbcan

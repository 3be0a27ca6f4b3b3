// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace cbcan {

/// Data types by their index in the dictionary (CiA 301, 7.4.7).
enum class DataType : std::uint8_t {
  kBoolean = 0x01,
  kInteger8 = 0x02,
  kInteger16 = 0x03,
  kInteger32 = 0x04,
  kUnsigned8 = 0x05,
  kUnsigned16 = 0x06,
  kUnsigned32 = 0x07,
  kReal32 = 0x08,
  kVisibleString = 0x09,
  kOctetString = 0x0A,
  kUnicodeString = 0x0B,
  kTimeOfDay = 0x0C,
  kTimeDifference = 0x0D,
  kDomain = 0x0F,
  kInteger24 = 0x10,
  kReal64 = 0x11,
  kInteger40 = 0x12,
  kInteger48 = 0x13,
  kInteger56 = 0x14,
  kInteger64 = 0x15,
  kUnsigned24 = 0x16,
  kUnsigned40 = 0x18,
  kUnsigned48 = 0x19,
  kUnsigned56 = 0x1A,
  kUnsigned64 = 0x1B,
};

/// See size_of(); by type.
inline constexpr std::array<std::uint8_t, 28> kDataTypeBytes{0, 1, 1, 2, 4, 1, 2, 4, 4, 0, 0, 0, 6, 6,
                                                             0, 0, 3, 8, 5, 6, 7, 8, 3, 0, 5, 6, 7, 8};

/// Bytes of a value of this type; 0 = the length varies (strings, DOMAIN) or the type is none of the above.
constexpr std::size_t size_of(DataType type) {
  const auto index = static_cast<std::size_t>(type);
  return index < kDataTypeBytes.size() ? kDataTypeBytes[index] : 0;
}

/// True for INTEGERnn.
constexpr bool is_signed(DataType type) {
  using enum DataType;
  return (type >= kInteger8 && type <= kInteger32) || type == kInteger24 ||
         (type >= kInteger40 && type <= kInteger64);
}

}  // namespace cbcan

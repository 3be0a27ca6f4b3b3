// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

namespace cbcan {

/// CRC of SDO block transfers: x^16 + x^12 + x^5 + 1, start value 0, no reflection (CiA 301, 7.2.4.3.16).
std::uint16_t crc16(std::span<const std::uint8_t> bytes);
/// The same of all bytes so far, whose CRC is `crc`, and these.
std::uint16_t crc16(std::uint16_t crc, std::span<const std::uint8_t> bytes);

}  // namespace cbcan

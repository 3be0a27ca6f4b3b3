// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace cbcan::test {

/// The CRC of a Modbus RTU frame, for tests and models: bit by bit as in MODBUS over Serial Line
/// V1.02, 6.2.2, independent of the product's code. `bytes`: any range of characters or bytes.
template <class Bytes>
constexpr std::uint16_t modbus_crc(const Bytes& bytes) {
  std::uint32_t crc = 0xFFFF;
  for (const auto byte : bytes) {
    crc ^= static_cast<std::uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc & 1) != 0 ? crc >> 1 ^ 0xA001 : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

/// A frame with its CRC; a container of characters or bytes.
template <class Frame>
Frame with_crc(Frame frame) {
  const std::uint16_t crc = modbus_crc(frame);
  for (const int byte : {crc & 0xFF, crc >> 8})
    frame.push_back(static_cast<typename Frame::value_type>(byte));
  return frame;
}

}  // namespace cbcan::test

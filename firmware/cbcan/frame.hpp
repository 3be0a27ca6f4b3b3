// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace cbcan {

/// One classical CAN frame (ISO 11898-1). 16 bytes; plain data, copied freely.
struct Frame {
  static constexpr std::uint8_t kRemote = 1;    ///< RTR: asks for the frame, carries no data
  static constexpr std::uint8_t kExtended = 2;  ///< 29-bit identifier
  static constexpr std::uint8_t kError = 4;     ///< the controller reports a bus error; not a frame on the bus

  std::uint32_t id = 0;     ///< 0..7FFh, or 0..1FFF FFFFh when extended
  std::uint8_t length = 0;  ///< DLC, 0..8
  std::uint8_t flags = 0;   ///< kRemote, kExtended, kError; 0 = a data frame as CANopen uses it
  alignas(8) std::array<std::uint8_t, 8> data{};

  friend constexpr bool operator==(const Frame&, const Frame&) = default;
};

/// Sets bytes 0..3 and 4..7 of data from a number each, lowest byte first: two stores.
inline void put_data(Frame& frame, std::uint32_t low, std::uint32_t high) {
  if constexpr (std::endian::native == std::endian::big) {
    low = __builtin_bswap32(low);
    high = __builtin_bswap32(high);
  }
  __builtin_memcpy(&frame.data[0], &low, 4);
  __builtin_memcpy(&frame.data[4], &high, 4);
}

/// State of the CAN controller, worst first when several hold (fault confinement, ISO 11898-1).
enum class BusState : std::uint8_t { kActive, kOverflow, kErrorPassive, kBusOff };

}  // namespace cbcan

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

/// Sets all eight bytes of data from one number, lowest byte first: a single store.
constexpr void put_data(Frame& frame, std::uint64_t bytes) {
  if constexpr (std::endian::native == std::endian::big) bytes = __builtin_bswap64(bytes);
  frame.data = std::bit_cast<std::array<std::uint8_t, 8>>(bytes);
}

/// State of the CAN controller, worst first when several hold (fault confinement, ISO 11898-1).
enum class BusState : std::uint8_t { kActive, kOverflow, kErrorPassive, kBusOff };

}  // namespace cbcan

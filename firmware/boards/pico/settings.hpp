// SPDX-License-Identifier: MIT
#pragma once

/// What a plant may want to change. The image must be rebuilt after a change.

#include "boards/pico/board.hpp"

namespace cbcan::boards::pico {

inline constexpr std::uint32_t kModbusBaud = 115'200;
inline constexpr std::uint32_t kCanCrystal = 8'000'000;  ///< Hz; is printed on that of the module
inline constexpr std::uint32_t kCanBitRate = 500'000;    ///< Hz; the most that 8 MHz give
static_assert(Mcp2515<CanSpi>::timing(kCanCrystal, kCanBitRate), "settings.hpp: not with this crystal");
/// Modbus station 1, CANopen node 127. USB adapters forward bytes in packets, hence the gap.
inline constexpr Station<1>::Settings kStationSettings{
    .modbus = {.silence_us = rtu_silence_us(kModbusBaud, 11), .gap_us = 20'000}, .coprocessors = {}};

}  // namespace cbcan::boards::pico

// SPDX-License-Identifier: MIT
#pragma once

/// The settings of the image for the contract's suite, as tests/firmware/mps2 has them.

#include "boards/pico/board.hpp"

namespace cbcan::boards::pico {

inline constexpr std::uint32_t kModbusBaud = 115'200, kCanCrystal = 8'000'000, kCanBitRate = 500'000;
inline constexpr Station<1>::Settings kStationSettings{
    .modbus = {.silence_us = 0, .gap_us = 250'000},
    .coprocessors = {{{.plc_timeout_ms = CBCAN_PLC_TIMEOUT_MS}}}};

}  // namespace cbcan::boards::pico

// SPDX-License-Identifier: MIT
#pragma once

/// The settings of the image for the contract's suite, instead of the board's own: a request needs no silence
/// after it, as the suite's clock is stopped meanwhile.

#include "boards/mps2_an385/board.hpp"

namespace cbcan::boards::mps2 {

inline constexpr ModbusBoard::Settings kBoardSettings{115'200, 115'200, 500};
inline constexpr Station<>::Settings kStationSettings{
    .modbus = {.silence_us = 0, .gap_us = 250'000},
    .coprocessors = {{{.plc_timeout_ms = CBCAN_PLC_TIMEOUT_MS}}}};

}  // namespace cbcan::boards::mps2

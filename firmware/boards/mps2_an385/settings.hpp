// SPDX-License-Identifier: MIT
#pragma once

/// What a plant may want to change. The image must be rebuilt after a change.

#include "boards/mps2_an385/board.hpp"

namespace cbcan::boards::mps2 {

inline constexpr ModbusBoard::Settings kBoardSettings{115'200, 115'200, 500};
/// Modbus station 1, CANopen node 127. The gap suits an emulator on a loaded PC, and is shorter than clients'
/// response timeouts; leave it out on a bench.
inline constexpr Station<>::Settings kStationSettings{
    .modbus = {.silence_us = rtu_silence_us(kBoardSettings.modbus_baud, 10), .gap_us = 250'000},
    .coprocessors = {}};

}  // namespace cbcan::boards::mps2

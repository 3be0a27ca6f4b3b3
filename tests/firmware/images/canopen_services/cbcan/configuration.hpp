// SPDX-License-Identifier: MIT
#pragma once

/// All services of CANopen that need no non-volatile memory: SDO with block transfer both ways, four PDOs each
/// way, SYNC, TIME, EMCY, NMT, heartbeats.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{.scanner_window = false,
                                    .rpdos = 4,
                                    .tpdos = 4,
                                    .stored_parameters = false,
                                    .lss = false,
                                    .manager_clients = 0,
                                    .other_devices = false,
                                    .counters = false,
                                    .serial_queue = 512};

}  // namespace cbcan

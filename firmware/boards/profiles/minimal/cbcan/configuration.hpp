// SPDX-License-Identifier: MIT
#pragma once

/// SDO, NMT, node states, heartbeats.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{.scanner_window = false,
                                    .block_transfer = false,
                                    .sdo_server = false,
                                    .emergencies = false,
                                    .time = false,
                                    .rpdos = 0,
                                    .tpdos = 0,
                                    .stored_parameters = false,
                                    .lss = false,
                                    .manager_clients = 0,
                                    .other_devices = false,
                                    .counters = false,
                                    .serial_queue = 512};

}  // namespace cbcan

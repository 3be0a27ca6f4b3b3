// SPDX-License-Identifier: MIT
#pragma once

/// Everything that the contract promises, and the manager that boots a network.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{
    .channels = false, .manager_clients = 2, .other_devices = false, .counters = false, .serial_queue = 512};

}  // namespace cbcan

// SPDX-License-Identifier: MIT
#pragma once

/// All that the contract promises, but LSS: for boards that store nothing.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{
    .lss = false, .other_devices = false, .counters = false, .serial_queue = 512};

}  // namespace cbcan

// SPDX-License-Identifier: MIT
#pragma once

/// The services of device.cpp.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{.scanner_window = false,
                                    .stored_parameters = false,
                                    .lss = false,
                                    .manager_clients = 0,
                                    .counters = false};

}  // namespace cbcan

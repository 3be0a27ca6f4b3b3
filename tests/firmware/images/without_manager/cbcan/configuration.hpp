// SPDX-License-Identifier: MIT
#pragma once

/// All services but the manager.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{.channels = false, .manager_clients = 0};

}  // namespace cbcan

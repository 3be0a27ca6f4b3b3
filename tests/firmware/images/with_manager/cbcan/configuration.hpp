// SPDX-License-Identifier: MIT
#pragma once

/// All services, with one channel.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{.channels = false};

}  // namespace cbcan

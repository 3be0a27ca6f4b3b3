// SPDX-License-Identifier: MIT
#pragma once

/// SDO, NMT, node states, heartbeats.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices = kMinimalServices;

}  // namespace cbcan

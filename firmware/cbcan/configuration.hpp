// SPDX-License-Identifier: MIT
#pragma once

/// Everything, unless an image has a header of this name ahead of this one: cbcan/services.hpp.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{};

}  // namespace cbcan

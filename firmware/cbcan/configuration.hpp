// SPDX-License-Identifier: MIT
#pragma once

/// The default: all services. An image may have its own header of this name: see cbcan/services.hpp.

#include "cbcan/services.hpp"

namespace cbcan {

inline constexpr Services kServices{.streamed_downloads = true};

}  // namespace cbcan

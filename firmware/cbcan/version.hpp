// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace cbcan {

/// The only definition of the version; CMake reads it from here.
inline constexpr std::string_view kVersion = "0.1.0";

}  // namespace cbcan

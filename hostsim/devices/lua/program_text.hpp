// SPDX-License-Identifier: MIT
#pragma once

/// Checks of the text of a Lua program before it runs. Pure functions.

#include <string_view>

namespace cbcan::devices {

/// Whether the operator % occurs outside strings and comments.
bool has_remainder(std::string_view program);

/// Whether a string of the program may contain the character 0: Lua compares such strings piece by piece.
bool has_zero(std::string_view program);

}  // namespace cbcan::devices

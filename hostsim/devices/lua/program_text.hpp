// SPDX-License-Identifier: MIT
#pragma once

/// What can be seen in the text of a Lua program before it runs. Pure.

#include <string_view>

namespace cbcan::devices {

/// The operator %, outside of texts and comments.
bool has_remainder(std::string_view program);

/// Whether a text of the program may have the character 0: Lua compares such texts piece by piece.
bool has_zero(std::string_view program);

}  // namespace cbcan::devices

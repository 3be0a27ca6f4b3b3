// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "plant/config.hpp"

namespace cbcan::plant {

/// Reads "virtual" or "socketcan:IFNAME" into kind and interface_name. Returns what is wrong with it and what
/// to write instead, and changes nothing then; empty = fine.
[[nodiscard]] std::string parse_can_spec(std::string_view spec, CanConfig& into);

}  // namespace cbcan::plant

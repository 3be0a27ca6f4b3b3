// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "plant/config.hpp"

namespace cbcan::plant {

/// Of a text that is to be "virtual" or "socketcan:IFNAME": what is wrong with it and what to write instead;
/// empty = fine.
[[nodiscard]] std::string check_can_spec(const Value& value);

}  // namespace cbcan::plant

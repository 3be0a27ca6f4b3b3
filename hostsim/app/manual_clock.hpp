// SPDX-License-Identifier: MIT
#pragma once

/// Time under the control of whoever writes to standard input: how it is asked for and told.

#include <string>
#include <string_view>

#include "cbcan/time.hpp"

namespace cbcan::app {

/// Does this line ask for time to pass, rightly or not?
bool is_pass(std::string_view line);

/// "pass 100ms": a whole number, and us, ms or s; 0 is allowed, a year the most. Throws io::UsageError.
Time parse_pass(std::string_view line);

/// "12.345678": seconds since the start.
std::string seconds_text(Time now);

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "io/loop/descriptor.hpp"
#include "window/connection.hpp"

namespace cbcan::io {

/// window::open_line(). Throws EnvironmentError, or UsageError for an unknown baud rate; the text begins with
/// `service`.
Descriptor open_serial(std::string_view service, const window::Line& line);

}  // namespace cbcan::io

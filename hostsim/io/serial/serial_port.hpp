// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "io/loop/system.hpp"
#include "io/sockets/listener.hpp"
#include "window/connection.hpp"

namespace cbcan::io {

/// window::open_line(). Throws EnvironmentError, or UsageError for an unknown baud rate; the text begins with
/// `service`.
Descriptor open_serial(std::string_view service, const window::Line& line);

/// A pseudo-terminal that other programs use as a serial port.
struct PseudoTerminal {
  /// Non-blocking, raw, with a symbolic link to the other side at `address`'s path. An abandoned link is
  /// replaced; any other file is left unchanged. Throws EnvironmentError, its text beginning with `service`.
  PseudoTerminal(std::string_view service, const StreamAddress& address);

  Descriptor port;
  OwnFile link;  ///< removed before the port closes
};

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "io/loop/descriptor.hpp"
#include "io/sockets/stream_listener.hpp"

namespace cbcan::io {

/// A serial port for programs that want one: what they read and write there is written and read here.
struct PseudoTerminal {
  /// Non-blocking, for characters as they are, with a symbolic link to the other side at `address`'s path. A
  /// link that a program has left behind is replaced; any other file is left alone. Throws EnvironmentError,
  /// its text beginning with `service`.
  PseudoTerminal(std::string_view service, const StreamAddress& address);

  Descriptor port;
  OwnFile link;  ///< goes first
};

}  // namespace cbcan::io

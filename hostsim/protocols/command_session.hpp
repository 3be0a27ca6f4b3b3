// SPDX-License-Identifier: MIT
#pragma once

/// Lines of text over a connection, each answered by lines of text: for people with `socat` or `nc`, and for
/// test programs.

#include "protocols/dialogue.hpp"
#include "protocols/stream_session.hpp"

namespace cbcan::protocols {

/// A line that is too long is answered by an error and not executed; empty lines
/// are ignored.
MakeSession command_sessions(Execute execute);

}  // namespace cbcan::protocols

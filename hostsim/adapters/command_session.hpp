// SPDX-License-Identifier: MIT
#pragma once

/// Lines of text over a connection, each answered by lines of text: for people with `socat` or `nc`, and for
/// test programs.

#include "adapters/dialogue.hpp"
#include "adapters/stream_session.hpp"

namespace cbcan::adapters {

/// A line that is too long is answered by an error and not executed; empty lines
/// are ignored.
MakeSession command_sessions(Execute execute);

}  // namespace cbcan::adapters

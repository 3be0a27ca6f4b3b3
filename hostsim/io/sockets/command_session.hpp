// SPDX-License-Identifier: MIT
#pragma once

/// Lines of text over a socket, each answered by lines of text: for people with `socat` or `nc`, and for test
/// programs.

#include "adapters/dialogue.hpp"
#include "io/sockets/stream_server.hpp"

namespace cbcan::io {

/// Sessions for a StreamServer. A line that is too long is answered by an error and not executed; empty lines
/// are ignored.
StreamServer::MakeSession command_sessions(adapters::Execute execute);

}  // namespace cbcan::io

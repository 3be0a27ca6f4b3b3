// SPDX-License-Identifier: MIT
#pragma once

/// Lines of text over a socket, each answered by lines of text: for people with `socat` or `nc`, and for test
/// programs.

#include <functional>
#include <string>
#include <string_view>

#include "io/sockets/stream_server.hpp"

namespace cbcan::io {

inline constexpr std::size_t kLongestCommand = 1000;

/// Executes one line, given without its end, and returns the response: whole lines.
using Execute = std::function<std::string(std::string_view line)>;

/// Sessions for a StreamServer. A line that is too long is answered by an error and not executed; empty lines
/// mean nothing.
StreamServer::MakeSession command_sessions(Execute execute);

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#pragma once

/// Lines of text over a socket, each answered by lines of text: for people with `socat` or `nc`, and for test
/// programs.

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "io/sockets/stream_server.hpp"

namespace cbcan::io {

inline constexpr std::size_t kLongestCommand = 1000;

/// One connection, as who executes its lines sees it. When the connection ends it is let go of here.
struct Dialogue {
  std::string unsent;    ///< on its way to the client; lines that nobody has asked for go in here too
  bool waiting = false;  ///< a response is outstanding: no further line is executed
};

/// Executes one line, given without its end, and returns the response, whole lines; or sets `waiting`, and
/// appends the response later.
using Execute = std::function<std::string(std::string_view line, const std::shared_ptr<Dialogue>& dialogue)>;

/// Sessions for a StreamServer. A line that is too long is answered by an error and not executed; empty lines
/// mean nothing.
StreamServer::MakeSession command_sessions(Execute execute);

}  // namespace cbcan::io

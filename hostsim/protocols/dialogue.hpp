// SPDX-License-Identifier: MIT
#pragma once

/// Commands as lines of text, each answered by lines of text: from a socket, standard input or HTTP.

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "protocols/stream_session.hpp"

namespace cbcan::protocols {

inline constexpr std::size_t kLongestCommand = 1000;

/// One connection, as the executor of its lines sees it. Shared: the connection drops it when it ends.
struct Dialogue {
  std::string unsent;    ///< for the client
  bool waiting = false;  ///< a response is outstanding: no further line is executed
};

/// Executes one line, given without its end, and returns the response, whole lines; or sets `waiting`, and
/// appends the response later.
using Execute = std::function<std::string(std::string_view line, const std::shared_ptr<Dialogue>& dialogue)>;

/// Sessions for people with `socat` or `nc`, and for test programs. A line that is too long is answered by an
/// error and not executed; empty lines are ignored.
MakeSession command_sessions(Execute execute);

}  // namespace cbcan::protocols

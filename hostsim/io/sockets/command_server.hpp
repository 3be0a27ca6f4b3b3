// SPDX-License-Identifier: MIT
#pragma once

/// Lines of text over a socket, each answered by lines of text: for people with `socat` or `nc`, and for test
/// programs.

#include <functional>
#include <string>
#include <string_view>

#include "io/sockets/stream_server.hpp"

namespace cbcan::io {

class CommandServer {
 public:
  static constexpr std::size_t kLongestLine = 1000;

  /// Executes one line, given without its end, and returns the answer: whole lines.
  using Execute = std::function<std::string(std::string_view line)>;

  /// Listens at once; throws EnvironmentError when it cannot. A line that is too long is answered by an error
  /// and not executed; empty lines mean nothing.
  CommandServer(Reactor& reactor, const StreamAddress& address, Execute execute, Warn warn);

  /// Where it listens, with the real port.
  const StreamAddress& address() const { return server_.address(); }
  void flush() { server_.flush(); }

 private:
  class Session;

  Execute execute_;
  StreamServer server_;
};

}  // namespace cbcan::io

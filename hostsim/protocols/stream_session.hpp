// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace cbcan::protocols {

/// The protocol side of one connection; destroyed with the connection.
class StreamSession {
 public:
  /// Nothing is to be read from a client that has this many bytes unread.
  static constexpr std::size_t kMostUnsent = 64 * 1024;

  virtual ~StreamSession() = default;

  /// The client has sent bytes.
  virtual void receive(std::string_view bytes) = 0;
  /// The client has closed its sending side.
  virtual void end_input() {}
  /// Clients send text, so a connection that begins like TLS is not one of them.
  virtual bool is_text() const { return true; }
  /// False: no more is to be read from the client.
  virtual bool wants_more() const { return true; }
  /// What is to be sent to the client; unchanged until sent() or receive() is called, or time passes.
  virtual std::string_view unsent() const = 0;
  /// How many bytes of unsent() are to be sent together, separate from the rest.
  virtual std::size_t segment() const { return unsent().size(); }
  /// The client's input has not been processed completely, or a response is outstanding.
  virtual bool is_busy() const { return false; }
  /// The connection is to be closed once everything has been sent.
  virtual bool has_ended() const { return false; }
  /// The first `count` bytes of unsent() have been sent.
  virtual void sent(std::size_t count) = 0;
};

using MakeSession = std::function<std::unique_ptr<StreamSession>()>;

/// A client that speaks HTTP, or TLS where text is expected, is called a browser and reaches no session:
/// pages of other sites can make a browser send to any address of this machine.
std::unique_ptr<StreamSession> without_browsers(std::unique_ptr<StreamSession> session,
                                                std::function<void()> on_browser);

// ---- Commands as lines of text, each answered by lines of text: from a socket, standard input or HTTP

inline constexpr std::size_t kLongestCommand = 1000;

/// One connection, as the executor of its lines sees it. Shared: the connection drops it when it ends.
struct Dialogue {
  std::string unsent;    ///< for the client
  bool waiting = false;  ///< a response is outstanding: no further line is executed
  bool killed = false;   ///< with the client, by its last line: those after it are dropped
};

/// Executes one line, given without its end, and returns the response, whole lines; or sets `waiting`, and
/// appends the response later.
using Execute = std::function<std::string(std::string_view line, const std::shared_ptr<Dialogue>& dialogue)>;

/// Sessions for people with `socat` or `nc`, and for test programs. A line that is too long is answered by an
/// error and not executed; empty lines are ignored.
MakeSession command_sessions(Execute execute);

}  // namespace cbcan::protocols

// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string_view>

namespace cbcan::adapters {

/// What one connection is about; it goes with the connection.
class StreamSession {
 public:
  virtual ~StreamSession() = default;

  /// Bytes have come from the client.
  virtual void receive(std::string_view bytes) = 0;
  /// The client has closed its sending side.
  virtual void end_input() {}
  /// Its clients send text, so bytes that begin as TLS does are none of theirs.
  virtual bool is_text() const { return true; }
  /// False: what more the client sends is to wait where it is.
  virtual bool wants_more() const { return true; }
  /// What is to go to the client; unchanged until sent() or receive() is called, or time passes.
  virtual std::string_view unsent() const = 0;
  /// How many of those are to leave in one piece, by themselves.
  virtual std::size_t segment() const { return unsent().size(); }
  /// What the client has sent is not done yet: a response is outstanding, or what waits for it.
  virtual bool is_busy() const { return false; }
  /// The connection is to be closed once all has gone.
  virtual bool has_ended() const { return false; }
  /// The first `count` bytes of unsent() have gone.
  virtual void sent(std::size_t count) = 0;
};

}  // namespace cbcan::adapters

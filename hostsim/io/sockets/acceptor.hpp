// SPDX-License-Identifier: MIT
#pragma once

/// Listens, takes in the clients, and turns them away at once when there is no descriptor left: one that were
/// left waiting would wake the reactor for ever.

#include <cstddef>
#include <cstdint>
#include <string>

#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"
#include "io/sockets/stream_listener.hpp"

namespace cbcan::io {

/// Who serves the clients.
class AcceptsClients {
 public:
  /// Gets each client's socket, which is closed if it throws: non-blocking, with kSendBufferBytes to send,
  /// and small responses go at once.
  virtual void adopt(Descriptor socket) = 0;
  /// How many there are, for the one line that is written when some are turned away.
  virtual std::size_t clients() const = 0;
  /// Further clients wait until Acceptor::resume().
  virtual bool is_full() const { return false; }
  /// Closes a connection that nobody misses, where there is one: its place is needed.
  virtual bool make_room() { return false; }

 protected:
  ~AcceptsClients() = default;
};

class Acceptor {
 public:
  static constexpr int kSendBufferBytes = 64 * 1024;

  /// Listens at once, see StreamListener; reactor and server are the caller's. Raises the limit of open
  /// descriptors.
  Acceptor(Reactor& reactor, std::string_view service, const StreamAddress& address, AcceptsClients& server,
           Warn warn);
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  const StreamListener& listener() const { return listener_; }

  /// A server that was full may have room again.
  void resume();

  /// Turned away.
  std::uint64_t refused() const { return refused_; }

  /// A line about a client, for the person who runs the program.
  void warn(const std::string& what) const { warn_(where_ + ": " + what); }

 private:
  void accept_clients();
  void hand_over(Descriptor socket);
  void turned_away(const std::string& why);
  bool refuse_client();

  Reactor& reactor_;
  StreamListener listener_;
  std::string where_;
  AcceptsClients& server_;
  Warn warn_;
  Descriptor reserve_;  ///< given up to be able to accept and close when there are no others
  bool told_ = false;
  std::uint64_t refused_ = 0;
};

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#pragma once

/// Listens, accepts clients, and refuses them when no descriptor is left: a client left waiting would wake
/// the reactor again and again.

#include <cstddef>
#include <string>

#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"
#include "io/sockets/listener.hpp"

namespace cbcan::io {

/// A server of accepted clients.
class AcceptsClients {
 public:
  /// Takes a client's socket, which is closed if this throws: non-blocking, with a send buffer of
  /// kSendBufferBytes and without delay for small responses.
  virtual void adopt(Descriptor socket) = 0;
  /// The number of clients, for the warning when some are refused.
  virtual std::size_t clients() const = 0;
  /// True: further clients wait until Acceptor::resume(), unless make_room() helps.
  virtual bool is_full() const { return false; }
  /// Closes a connection that is no longer used, to free its descriptor; false = there is none.
  virtual bool make_room() { return false; }

 protected:
  ~AcceptsClients() = default;
};

class Acceptor {
 public:
  static constexpr int kSendBufferBytes = 64 * 1024;

  /// Starts listening, see StreamListener; reactor and server outlive this. Raises the limit of open
  /// descriptors.
  Acceptor(Reactor& reactor, std::string_view service, const StreamAddress& address, AcceptsClients& server,
           Warn warn);
  ~Acceptor() { reactor_.forget(listener_.socket()); }
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  const StreamListener& listener() const { return listener_; }

  /// Call it when a full server may have room again.
  void resume() { reactor_.change(listener_.socket(), Reactor::kReadable); }

  /// Writes a line about a client for the user.
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
  Descriptor reserve_;  ///< closed to accept and refuse a client when no other is left
  bool told_ = false;
};

}  // namespace cbcan::io

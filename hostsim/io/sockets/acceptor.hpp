// SPDX-License-Identifier: MIT
#pragma once

/// Listens, takes in the clients, and turns them away at once when there is no descriptor left: one that were
/// left waiting would wake the reactor for ever.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"
#include "io/sockets/stream_listener.hpp"

namespace cbcan::io {

class Acceptor {
 public:
  static constexpr int kSendBufferBytes = 64 * 1024;

  /// Gets each client's socket, which is closed if it throws: non-blocking, with kSendBufferBytes to send,
  /// and small responses go at once.
  using OnClient = std::function<void(Descriptor)>;

  /// Listens at once, see StreamListener; the reactor is the caller's. `clients` says how many there are, for
  /// the one line that is told when some are turned away. Raises the limit of open descriptors.
  Acceptor(Reactor& reactor, std::string_view service, const StreamAddress& address, OnClient on_client,
           std::function<std::size_t()> clients, Warn warn);
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  const StreamListener& listener() const { return listener_; }

  /// Turned away.
  std::uint64_t refused() const { return refused_; }

 private:
  void accept_clients();
  void hand_over(Descriptor socket);
  void turned_away(const std::string& why);
  bool refuse_client();

  Reactor& reactor_;
  StreamListener listener_;
  std::string where_;
  OnClient on_client_;
  std::function<std::size_t()> clients_;
  Warn warn_;
  Descriptor reserve_;  ///< given up to be able to accept and close when there are no others
  bool told_ = false;
  std::uint64_t refused_ = 0;
};

}  // namespace cbcan::io

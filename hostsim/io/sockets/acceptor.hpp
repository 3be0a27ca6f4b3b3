// SPDX-License-Identifier: MIT
#pragma once

/// Takes in the clients of a listening socket, and turns them away at once when there is no descriptor left:
/// one that were left waiting would wake the reactor for ever.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::io {

class Acceptor {
 public:
  /// Gets each client's socket, non-blocking.
  using OnClient = std::function<void(Descriptor)>;

  /// Watches `listener`, a non-blocking listening socket of the caller's, who keeps it and the reactor alive.
  /// `where` begins the one line that is told when clients are turned away; `clients` says how many there
  /// are. Raises the limit of open descriptors.
  Acceptor(Reactor& reactor, int listener, std::string where, OnClient on_client,
           std::function<std::size_t()> clients, Warn warn);
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  /// Turned away.
  std::uint64_t refused() const { return refused_; }

 private:
  void accept_clients();
  bool refuse_client();

  Reactor& reactor_;
  int listener_;
  std::string where_;
  OnClient on_client_;
  std::function<std::size_t()> clients_;
  Warn warn_;
  Descriptor reserve_;  ///< given up to be able to accept and close when there are no others
  bool full_told_ = false;
  std::uint64_t refused_ = 0;
};

}  // namespace cbcan::io

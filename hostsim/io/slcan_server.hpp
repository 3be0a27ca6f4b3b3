// SPDX-License-Identifier: MIT
#pragma once

/// CAN adapters behind sockets: each connection is a LAWICEL adapter of its own on a simulated bus
/// (sim/slcan_adapter.hpp), closed until it is told to open, and gets every frame that another one, the
/// module or a node sends.
///
/// Nothing blocks. A client that does not read loses frames, where they are limited, and is told so by F; one
/// that asks and does not read the answers is not read from either.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "io/acceptor.hpp"
#include "io/descriptor.hpp"
#include "io/errors.hpp"
#include "io/reactor.hpp"
#include "io/stream_listener.hpp"
#include "sim/slcan_adapter.hpp"

namespace cbcan::io {

class SlcanServer {
 public:
  using OnQueued = sim::SlcanAdapter::OnQueued;

  /// Listens at once; throws EnvironmentError when it cannot. `on_queued` is called for each frame that a
  /// client has sent, before anything else is looked at. `most_unsent`: see SlcanAdapter. Reactor and bus are
  /// the caller's; the bus is not advanced after this has gone.
  SlcanServer(Reactor& reactor, sim::Bus& bus, const StreamAddress& address, std::size_t most_unsent,
              OnQueued on_queued, Warn warn);
  ~SlcanServer();
  SlcanServer(const SlcanServer&) = delete;
  SlcanServer& operator=(const SlcanServer&) = delete;

  /// Where it listens, with the real port.
  const StreamAddress& address() const { return listener_.address(); }

  /// Sends what the bus has brought; to be called once per turn, before waiting.
  void flush();

  std::size_t clients() const { return connections_.size(); }

  struct Counters {
    std::uint64_t connections = 0;  ///< accepted
    std::uint64_t lost = 0;         ///< frames that clients did not read in time
  };
  Counters counters() const;

 private:
  struct Connection;

  void adopt(Descriptor socket);
  void close_client(Connection& client);
  std::unique_ptr<sim::SlcanAdapter> take_adapter();
  bool receive(Connection& client);
  bool send(Connection& client);
  void watch(Connection& client);

  Reactor& reactor_;
  sim::Bus& bus_;
  std::size_t most_unsent_;
  OnQueued on_queued_;
  StreamListener listener_;
  std::unordered_map<int, std::unique_ptr<Connection>> connections_;
  std::vector<std::unique_ptr<sim::SlcanAdapter>> idle_;  ///< a bus cannot let go of one: they are used again
  Counters counters_;
  Acceptor acceptor_;
};

}  // namespace cbcan::io

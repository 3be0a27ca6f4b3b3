// SPDX-License-Identifier: MIT
#pragma once

/// CAN adapters behind sockets: each connection is a LAWICEL adapter of its own on a simulated bus
/// (sim/slcan_adapter.hpp), closed until it is told to open, and gets every frame that another one, the
/// module or a node sends. A client that does not read loses frames, where they are limited, and is told so
/// by F.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "io/sockets/stream_server.hpp"
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

  /// Where it listens, with the real port.
  const StreamAddress& address() const { return server_.address(); }

  /// Sends what the bus has brought; to be called once per turn, before waiting.
  void flush() { server_.flush(); }

  std::size_t clients() const { return server_.clients(); }

  struct Counters {
    std::uint64_t connections = 0;  ///< accepted
    std::uint64_t lost = 0;         ///< frames that clients did not read in time
  };
  Counters counters() const;

 private:
  class Session;

  sim::SlcanAdapter& take_adapter();

  sim::Bus& bus_;
  std::size_t most_unsent_;
  OnQueued on_queued_;
  /// A bus cannot let go of an adapter: those of connections that have ended are used again.
  std::vector<std::unique_ptr<sim::SlcanAdapter>> adapters_;
  std::vector<sim::SlcanAdapter*> idle_;
  StreamServer server_;
};

}  // namespace cbcan::io

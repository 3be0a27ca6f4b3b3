// SPDX-License-Identifier: MIT
#pragma once

/// Clients of a simulated bus behind sockets: each connection is an adapter of its own (sim/adapter.hpp) and
/// gets every frame that another one, the module or a node sends. A client that does not read loses frames,
/// where they are limited.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "adapters/adapter.hpp"
#include "io/sockets/stream_server.hpp"

namespace cbcan::io {

class AdapterServer {
 public:
  using MakeAdapter = std::function<std::unique_ptr<adapters::Adapter>()>;

  /// Listens at once; throws EnvironmentError when it cannot, its text beginning with `service`. `make` makes
  /// an adapter where there is none idle; its bus is not advanced after this has gone. The reactor is the
  /// caller's.
  AdapterServer(Reactor& reactor, std::string_view service, const StreamAddress& address, MakeAdapter make,
                Warn warn);

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

  adapters::Adapter& take_adapter();

  MakeAdapter make_;
  /// A bus cannot let go of an adapter: those of connections that have ended are used again.
  std::vector<std::unique_ptr<adapters::Adapter>> adapters_;
  std::vector<adapters::Adapter*> idle_;
  StreamServer server_;
};

}  // namespace cbcan::io

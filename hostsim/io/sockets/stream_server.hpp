// SPDX-License-Identifier: MIT
#pragma once

/// A server of byte streams: each connection has a session that turns requests into responses. Nothing
/// blocks; nothing is read from a client that does not read its responses. When a client closes its sending
/// side, its input is still executed and answered, even if it no longer reads. A pseudo-terminal is one
/// connection with a new session for each client. A client that speaks HTTP, or TLS where text is expected,
/// is refused before its bytes reach a session: pages of other sites can make a browser send them to any
/// address of this machine.

#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"
#include "io/sockets/listener.hpp"
#include "protocols/stream_session.hpp"

namespace cbcan::io {

using protocols::StreamSession;

class StreamServer final : private AcceptsClients {
 public:
  using MakeSession = protocols::MakeSession;

  /// Starts listening; throws EnvironmentError, its text beginning with `service`. The reactor outlives this.
  StreamServer(Reactor& reactor, std::string_view service, const StreamAddress& address, MakeSession make,
               Warn warn);
  ~StreamServer();
  StreamServer(const StreamServer&) = delete;
  StreamServer& operator=(const StreamServer&) = delete;

  /// The address with the actual port instead of port 0.
  const StreamAddress& address() const { return acceptor_ ? acceptor_->listener().address() : address_; }

  /// Sends what the sessions have to send; to be called once per turn, before waiting.
  void flush();

  std::size_t clients() const override { return connections_.size(); }

 private:
  struct Connection;

  void adopt(Descriptor socket) override;
  bool make_room() override;
  void close(Connection& client);
  std::size_t read_bytes() const;
  bool receive(Connection& client);
  void warn_of_browser();
  bool send(Connection& client);
  bool watch(Connection& client);

  Reactor& reactor_;
  MakeSession make_;
  std::unordered_map<int, std::unique_ptr<Connection>> connections_;
  bool browser_reported_ = false;
  StreamAddress address_;  ///< of a terminal
  OwnFile link_;
  std::optional<Acceptor> acceptor_;
};

}  // namespace cbcan::io

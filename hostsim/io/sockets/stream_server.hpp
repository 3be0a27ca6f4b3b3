// SPDX-License-Identifier: MIT
#pragma once

/// A server of byte streams: each connection has a session that makes bytes out of bytes. Nothing blocks; a
/// client that asks and does not read the responses is not read from either. A client that closes its sending
/// side is answered first, and what it has sent is done even if it no longer reads. A pseudo-terminal is one
/// connection, which has a new session for each client. A client that speaks HTTP, or TLS where
/// text is expected, is turned away before its bytes reach a session: pages of other sites can make a browser
/// send them to any address of this machine.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "adapters/stream_session.hpp"
#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"
#include "io/sockets/acceptor.hpp"

namespace cbcan::io {

using adapters::StreamSession;

class StreamServer final : private AcceptsClients {
 public:
  /// Clients with more than that unread are not listened to.
  static constexpr std::size_t kMostUnsent = 64 * 1024;

  using MakeSession = std::function<std::unique_ptr<StreamSession>()>;

  /// Listens at once; throws EnvironmentError when it cannot, its text beginning with `service`. The reactor
  /// is the caller's.
  StreamServer(Reactor& reactor, std::string_view service, const StreamAddress& address, MakeSession make,
               Warn warn);
  ~StreamServer();
  StreamServer(const StreamServer&) = delete;
  StreamServer& operator=(const StreamServer&) = delete;

  /// Where it listens, with the real port.
  const StreamAddress& address() const { return acceptor_ ? acceptor_->listener().address() : address_; }

  /// Sends what sessions have to say; to be called once per turn, before waiting.
  void flush();

  std::size_t clients() const override { return connections_.size(); }
  /// Accepted since the start.
  std::uint64_t connections() const { return accepted_; }

 private:
  struct Connection;

  void adopt(Descriptor socket) override;
  bool make_room() override;
  void serve_pty(std::string_view service);
  void close(Connection& client);
  std::size_t read_bytes() const;
  bool receive(Connection& client);
  bool hand_over(Connection& client, std::string_view bytes);
  bool send(Connection& client);
  bool watch(Connection& client);

  Reactor& reactor_;
  MakeSession make_;
  std::unordered_map<int, std::unique_ptr<Connection>> connections_;
  std::uint64_t accepted_ = 0;
  bool browser_reported_ = false;
  StreamAddress address_;  ///< of a terminal
  OwnFile link_;
  std::optional<Acceptor> acceptor_;
};

}  // namespace cbcan::io

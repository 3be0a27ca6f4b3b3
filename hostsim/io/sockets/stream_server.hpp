// SPDX-License-Identifier: MIT
#pragma once

/// A server of byte streams: each connection has a session that makes bytes out of bytes. Nothing blocks; a
/// client that asks and does not read the responses is not read from either. A client that closes its sending
/// side is answered first, and what it has sent is done even if it no longer reads. A pseudo-terminal is one
/// connection, which has a new session for each client. A client that speaks HTTP is turned away before its
/// bytes reach a session: pages of other sites can make a browser send them to any address of this machine.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"
#include "io/sockets/acceptor.hpp"

namespace cbcan::io {

/// What one connection is about; it goes with the connection.
class StreamSession {
 public:
  virtual ~StreamSession() = default;

  /// Bytes have come from the client.
  virtual void receive(std::string_view bytes) = 0;
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
  void serve_terminal(std::string_view service);
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
  bool http_told_ = false;
  StreamAddress address_;  ///< of a terminal
  OwnFile link_;
  std::optional<Acceptor> acceptor_;
};

}  // namespace cbcan::io

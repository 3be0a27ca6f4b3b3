// SPDX-License-Identifier: MIT
#pragma once

/// The clients of a Modbus TCP server (protocols/modbus_server.hpp), any number of them, in one thread.
///
/// No client can delay another one: nothing blocks, a client gets a bounded number of requests per turn,
/// nothing is read from one that does not read its responses, and an incomplete request waits in its own
/// connection.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <unordered_map>
#include <utility>

#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"
#include "io/sockets/listener.hpp"
#include "protocols/modbus_server.hpp"

namespace cbcan::io {

class ModbusTcp final : private AcceptsClients {
 public:
  /// A connection is closed when an incomplete request gets no further byte for this long. Idle ones stay, as
  /// long as there are descriptors.
  static constexpr Time kHalfRequestTimeout = 5 * kSecond;

  /// Starts listening; throws EnvironmentError on failure. Raises the limit of open descriptors, which alone
  /// limits the number of clients: a further one closes the connection that has been idle for longest.
  /// `server` and `reactor` outlive this.
  ModbusTcp(Reactor& reactor, const ListenAddress& listen, protocols::ModbusServer& server, Warn warn);
  ~ModbusTcp();
  ModbusTcp(const ModbusTcp&) = delete;
  ModbusTcp& operator=(const ModbusTcp&) = delete;

  /// The address with the actual port instead of port 0.
  const ListenAddress& address() const { return acceptor_.listener().address().tcp; }

  /// When poll() is to be called next; kNever while there is no incomplete request.
  Time next_deadline() const { return deadlines_.empty() ? kNever : deadlines_.begin()->first; }

  /// Closes the connections whose incomplete request has waited too long. `now` is Reactor::time()'s.
  void poll(Time now);

  /// Serves a connected, non-blocking stream socket.
  void adopt(Descriptor socket) override;

  std::size_t clients() const override { return connections_.size(); }

 private:
  struct Connection;
  using Bytes = protocols::ModbusServer::Bytes;
  bool make_room() override;
  void close_client(Connection& client);

  bool on_ready(Connection& client);
  bool receive(Connection& client);
  bool advance(Connection& client);
  bool send(Connection& client, Bytes bytes);
  void set_deadline(Connection& client, Time deadline);

  Reactor& reactor_;
  protocols::ModbusServer& server_;
  std::unordered_map<int, std::unique_ptr<Connection>> connections_;
  std::set<std::pair<Time, int>> deadlines_;  ///< of incomplete requests, with the connection's descriptor
  std::uint64_t uses_ = 0;                    ///< connections, and reads from them
  Acceptor acceptor_;
};

}  // namespace cbcan::io

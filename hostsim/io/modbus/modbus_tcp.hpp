// SPDX-License-Identifier: MIT
#pragma once

/// A Modbus TCP server (protocols/modbus_server.hpp has the protocol) over the caller's 16-bit holding
/// registers, of one network or several, for any number of clients, in one thread.
///
/// No client can delay another one: nothing blocks, a client gets a bounded number of requests per turn,
/// nothing is read from one that does not read its responses, and an incomplete request waits in its own
/// connection.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "cbcan/modbus/identification.hpp"
#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"
#include "io/sockets/listener.hpp"
#include "protocols/modbus_server.hpp"

namespace cbcan::io {

struct ModbusTcpSettings {
  ListenAddress listen{"127.0.0.1", 1502};
  modbus::DeviceIdentity identity;  ///< its texts outlive the server
  /// A connection is closed when an incomplete request gets no further byte for this long. Idle ones stay, as
  /// long as there are descriptors.
  Time half_request_timeout = 5 * kSecond;
};

class ModbusTcp final : private AcceptsClients {
 public:
  /// Starts listening; throws EnvironmentError on failure. Raises the limit of open descriptors, which alone
  /// limits the number of clients: a further one closes the connection that has been idle for longest.
  /// `networks`: see protocols::ModbusServer; they and `reactor` outlive the server.
  ModbusTcp(Reactor& reactor, const std::vector<protocols::ModbusUnit*>& networks, ModbusTcpSettings settings,
            Warn warn);
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
  /// Called when a client connects or leaves: its number, its address and whether it has connected.
  std::function<void(std::uint32_t client, std::string_view address, bool joined)> on_client;

  struct Counters : protocols::ModbusServer::Counters {
    std::uint64_t connections = 0;     ///< accepted
    std::uint64_t waits_for_room = 0;  ///< responses that had to wait for room in the client's connection
  };
  Counters counters() const { return {server_.counters(), connected_, waits_for_room_}; }

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
  ModbusTcpSettings settings_;
  protocols::ModbusServer server_;
  std::unordered_map<int, std::unique_ptr<Connection>> connections_;
  std::set<std::pair<Time, int>> deadlines_;  ///< of incomplete requests, with the connection's descriptor
  std::uint64_t connected_ = 0;
  std::uint64_t uses_ = 0;  ///< connections, and reads from them
  std::uint64_t waits_for_room_ = 0;
  Acceptor acceptor_;
};

}  // namespace cbcan::io

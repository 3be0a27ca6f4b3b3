// SPDX-License-Identifier: MIT
#pragma once

/// Connections of a network with the world outside the program: CAN interface, SLCAN and socketcand servers,
/// log; and the client of a PLC that owns the registers.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "app/clock.hpp"
#include "config/can_spec.hpp"
#include "config/config.hpp"
#include "io/can/candump_log.hpp"
#include "io/can/outside_bus.hpp"
#include "io/loop/reactor.hpp"
#include "io/modbus/plc_client.hpp"
#include "io/serial/serial_port.hpp"
#include "io/sockets/stream_server.hpp"
#include "plant/network.hpp"
#include "protocols/socketcand_adapter.hpp"
#include "session/addresses.hpp"

namespace cbcan::app {

window::Line line_of(const config::LineConfig& config);

class BusConnections {
 public:
  /// Opens all; throws io::EnvironmentError. The arguments outlive it. `name`: prefix of messages.
  BusConnections(const config::NetworkConfig& config, std::string name, plant::Network& network,
                 io::Reactor& reactor, const Clock& clock, const io::Warn& warn);
  BusConnections(const BusConnections&) = delete;
  BusConnections& operator=(const BusConnections&) = delete;

  /// There is one that has to be polled every turn.
  bool exist() const { return outside_ || slcan_.server || socketcand_.server || log_ || plc_; }

  session::NetworkAddresses addresses() const;

  /// Call it before the network is advanced.
  void poll_outside() {
    if (outside_) outside_->poll(clock_.now());
  }
  /// The bus, and the bus outside.
  void advance() {
    poll_outside();
    network_.advance();
  }
  /// Call it once per turn with the reactor's time, and at next_deadline().
  void poll(Time now);
  void flush();
  Time next_deadline() const;

  std::string plc_summary() const;
  std::string adapters_summary() const;

 private:
  /// Those of SLCAN, or of socketcand.
  struct Clients {
    std::optional<io::StreamServer> server{};
    std::uint64_t lost = 0;  ///< frames that they have not read in time
  };

  void open_outside();
  void open_servers(const config::CanConfig& config);
  void open_plc(const config::NetworkConfig& config);
  void open_log(const config::NetworkConfig& config);

  plant::Network& network_;
  io::Reactor& reactor_;
  const Clock& clock_;
  const io::Warn& warn_;
  std::size_t number_;
  std::string name_;
  std::string can_;
  std::optional<io::CandumpLog> log_;
  std::optional<config::CanSpec> spec_;  ///< of the bus outside
  std::unique_ptr<io::OutsideBus> outside_;
  std::optional<protocols::SocketcandBus> socketcand_bus_;
  Clients slcan_;
  Clients socketcand_;
  std::optional<io::PlcClient> plc_;
};

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

/// Connections of a network with the world outside the program: CAN interface and log; and the client of a
/// PLC that owns the registers.

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/config.hpp"
#include "io/can/candump_log.hpp"
#include "io/can/outside_bus.hpp"
#include "io/loop/output.hpp"
#include "io/loop/reactor.hpp"
#include "io/modbus/plc_client.hpp"
#include "plant/network.hpp"
#include "session/session.hpp"

namespace cbcan::app {

window::Line line_of(const config::LineConfig& config);

/// Limit of output that is not read in time, in bytes: on a manual clock hours may pass at once.
inline std::size_t most_waiting(const session::Host& host) {
  return host.clock_runs() ? io::Output::kMostWaiting : 256 * 1024 * 1024;
}

class BusConnections {
 public:
  /// Opens all; throws io::EnvironmentError. The arguments outlive it.
  BusConnections(const config::NetworkConfig& config, plant::Network& network, io::Reactor& reactor,
                 const session::Host& host, const io::Warn& warn);
  BusConnections(const BusConnections&) = delete;
  BusConnections& operator=(const BusConnections&) = delete;

  /// There is one that has to be polled every turn.
  bool exist() const { return outside_ || log_ || plc_; }

  /// Place of the PLC that owns the registers; empty = none.
  std::string plc() const { return plc_ ? plc_->place() : ""; }

  /// Call it before the network is advanced.
  void poll_outside() {
    if (outside_) outside_->poll(host_.now());
  }
  /// The bus, and the bus outside.
  void advance() {
    poll_outside();
    network_.advance();
  }
  /// Call it once per turn with the reactor's time, and at next_deadline().
  void poll(Time now);
  void flush() {
    if (log_) log_->flush();
  }
  Time next_deadline() const;

  /// `name`: prefix of the line.
  std::string plc_summary(std::string_view name) const;

 private:
  void open_outside(const std::string& can_spec);
  void open_plc(const config::NetworkConfig& config);
  void open_log(const config::NetworkConfig& config);

  plant::Network& network_;
  io::Reactor& reactor_;
  const session::Host& host_;
  const io::Warn& warn_;
  std::optional<io::CandumpLog> log_;
  std::optional<config::CanSpec> spec_;  ///< of the bus outside
  std::unique_ptr<io::OutsideBus> outside_;
  std::optional<io::PlcClient> plc_;
};

}  // namespace cbcan::app

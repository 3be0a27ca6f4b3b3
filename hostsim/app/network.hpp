// SPDX-License-Identifier: MIT
#pragma once

/// One CAN network of cbcan-sim: registers, module, nodes and bus of a World, with a CAN interface, SLCAN
/// adapters or nothing behind it, and a log of what is on the bus.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "adapters/socketcand_adapter.hpp"
#include "app/clock.hpp"
#include "config/build_node.hpp"
#include "config/can_spec.hpp"
#include "config/config.hpp"
#include "io/can/adapter_server.hpp"
#include "io/can/beacon.hpp"
#include "io/can/candump_log.hpp"
#include "io/can/outside_bus.hpp"
#include "io/files/parameter_file.hpp"
#include "io/loop/reactor.hpp"
#include "io/modbus/modbus_unit.hpp"
#include "io/modbus/plc_client.hpp"
#include "io/serial/serial_port.hpp"
#include "plant/network.hpp"
#include "sim/schedule.hpp"

namespace cbcan::app {

window::Line line_of(const config::LineConfig& config);

/// What the networks of one program have in common.
struct Surroundings {
  io::Reactor& reactor;
  sim::Schedule& schedule;
  io::Warn warn;
  const Clock& clock;
  Time started;
  /// The PLC has written this, which has had no effects yet; and now it has.
  std::function<void(std::size_t network, const adapters::ModbusRange& written)> on_written;
  std::function<void()> on_applied;
};

class Network final : public io::ModbusUnit, public sim::Timed, private sim::FaultListener {
 public:
  /// `config` is one of `plant`'s, and `nodes` has one for each of its nodes, in their order. Opens
  /// everything; throws io::EnvironmentError, or io::UsageError for a parameter file that cannot be
  /// understood.
  Network(const config::Config& plant, const config::NetworkConfig& config, std::vector<sim::NodeParts> nodes,
          const Surroundings& surroundings);
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  /// None where there is no module.
  std::span<std::uint16_t> registers() override { return core_.registers(); }

  /// As commands see it.
  plant::Network& core() { return core_; }

  /// "can=virtual slcan=127.0.0.1:29536"; of network 2 "2/can=virtual 2/slcan=127.0.0.1:29537".
  std::string where() const;

  /// How programs join the bus: for each door a line that can be copied.
  std::string ways_in() const;

  /// `attended`: somebody besides wants to know what the PLC writes, see Surroundings.
  void start(bool attended);

  void catch_up() override;
  void on_diagnostics() override {
    catch_up();
    core_.publish(surroundings_.clock.now());
  }
  void on_writer(std::uint32_t client, const adapters::ModbusRange& written) override {
    core_.on_writer(client, written.first, written.count, surroundings_.clock.now());
  }
  void on_request(bool valid, const adapters::ModbusRange& written) override;
  bool listens() const override { return core_.watch() != nullptr; }
  void on_exchange(const journal::ModbusExchange& exchange) override {
    core_.watch()->on_modbus(exchange, surroundings_.clock.now());
  }

  /// Does what is due.
  void advance();
  void poll(Time /*now*/) override { advance(); }

  /// There is more to it than the world: a CAN interface, adapters, a log, a PLC that owns the registers.
  /// Such a one is to be advanced and turned in every turn; for others the Schedule will do, where time
  /// passes.
  bool has_doors() const { return outside_ || slcan_ || socketcand_ || log_ || plc_; }

  /// Does what is due with the PLC, and the log and the adapters have what the bus has brought. `now` is
  /// Reactor::time()'s.
  void turn(Time now);
  /// The latter alone.
  void flush();

  /// When the world has something to do next.
  Time next_event() const { return core_.next_deadline(); }

  /// When the doors have something to do next, if nothing comes.
  Time door_deadline() const;

  /// What the module has done, the PLC and the adapters, in lines for people.
  std::string module_summary() const;
  std::string plc_summary() const;
  std::string doors_summary() const;

 private:
  sim::ParameterStore* parameters_in(const std::string& file);
  std::vector<sim::NodeParts> with_parameters(const config::NetworkConfig& config,
                                              std::vector<sim::NodeParts> nodes);
  void tell_time_of_day();
  void open_outside();
  void open_servers(const config::CanConfig& config);
  void open_plc(const config::NetworkConfig& config);
  void open_log(const config::NetworkConfig& config);
  void on_fault(std::string_view text, Time now) override;
  sim::World& world() { return core_.world(); }

  Surroundings surroundings_;
  std::size_t number_;
  bool attended_ = true;
  std::string name_;  ///< in front of lines for people; empty if it is the only one
  std::string can_;
  std::vector<std::unique_ptr<io::ParameterFile>> parameters_;
  plant::Network core_;
  std::optional<io::CandumpLog> log_;
  std::optional<config::CanSpec> spec_;  ///< of what is outside
  std::unique_ptr<io::OutsideBus> outside_;
  std::optional<io::AdapterServer> slcan_;
  std::optional<adapters::SocketcandBus> socketcand_bus_;
  std::optional<io::AdapterServer> socketcand_;
  std::optional<io::Beacon> beacon_;
  std::optional<io::PlcClient> plc_;
};

}  // namespace cbcan::app

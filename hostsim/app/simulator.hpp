// SPDX-License-Identifier: MIT
#pragma once

/// cbcan-sim as a whole: CAN networks, Modbus servers, commands at run time, and the clock.

#include <unistd.h>

#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "app/console.hpp"
#include "config/build_node.hpp"
#include "config/config.hpp"
#include "io/can/outside_bus.hpp"
#include "io/files/captures.hpp"
#include "io/files/parameter_file.hpp"
#include "io/http/http_server.hpp"
#include "io/loop/lines.hpp"
#include "io/loop/process.hpp"
#include "io/loop/reactor.hpp"
#include "io/modbus/modbus_rtu.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "io/modbus/plc_client.hpp"
#include "io/sockets/stream_server.hpp"
#include "plant/network.hpp"
#include "session/session.hpp"

namespace cbcan::app {

window::Line line_of(const config::LineConfig& config);

/// Limit of output that is not read in time, in bytes: on a manual clock hours may pass at once.
inline constexpr std::uint64_t kMegabyte = 1'000'000;

inline std::size_t most_waiting(const session::Host& host) {
  return host.clock_runs() ? io::Output::kMostWaiting : 256 * 1024 * 1024;
}

/// Connections of a network with the world outside the program: CAN interface and log; and the client of a
/// PLC that owns the registers.
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
  /// Continues the log in the file that has its path now. False: there is no such file.
  bool reopen_log() { return log_ && log_->reopen(); }
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

/// A script's wait has timed out.
class CheckFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Simulator final : private session::Host {
 public:
  /// The parameter files of modules and nodes: written, or as copies in memory.
  enum class Files : std::uint8_t { kWritten, kCopied };

  /// `build` is the result of config::build_nodes() for `config`. Opens everything; throws
  /// io::EnvironmentError, or io::UsageError for an invalid parameter file. `plant_file`: path, "demo" or
  /// empty. `reads_input`: on a manual clock, standard input is for commands, unless this is a background job
  /// of a terminal, and its end ends the program.
  Simulator(const config::Config& config, config::PlantBuild build, const std::string& plant_file,
            Console& console, bool reads_input, Files files = Files::kWritten);

  /// Serves until SIGINT, SIGTERM, SIGHUP without a log to reopen, or the end of the commands. Throws
  /// io::UsageError for a wrong line of standard input, CheckFailed for a wait that times out.
  void run();
  /// Serves as long as the command runs, with the addresses in its environment, and returns its exit code.
  /// `error`: its standard error. Throws io::EnvironmentError if the process cannot be created.
  int run(const std::vector<std::string>& command, int error = STDERR_FILENO);
  /// No request is served from now on, and run() returns; a command is killed with this object.
  void stop() { stopping_ = true; }

  /// Counters, in lines for people.
  std::string summary() const;

  session::Session& session() { return *session_; }
  void let_pass(Time duration) override;

 private:
  const Time& now() const override { return clock_runs_ ? reactor_.time() : manual_now_; }
  bool clock_runs() const override { return clock_runs_; }
  Time machine_now() const override { return io::Reactor::now(); }
  Time wall_offset() const override { return clock_runs_ ? io::Reactor::wall_offset() : 0; }
  void tell(std::string_view lines) override { console_.tell(lines); }
  void say(std::string_view lines) override { console_.say(lines); }
  sim::ParameterStore* store(const std::string& file) override;
  void advance_buses() override;
  void flush() override;
  session::Served served() const override;
  void shut_down() override;
  [[noreturn]] void fail(base::ExitCode code, const std::string& why) override;
  void restart_command() override;

  void open_buses(const config::Config& config);
  plant::Plant& plant() { return session_->plant(); }
  void open_modbus(const config::Config& config);
  void open_views(const config::Config& config);
  void open_services(const config::Config& config);
  bool stop_requested() const;
  void drive_by_commands();
  void poll_clients();
  void take_lines(io::LineInput& input);
  void let_time_pass();
  /// Does what is due, waits until `until` at most, and handles input; returns the number of inputs.
  std::size_t poll(Time until);
  void poll_views();
  Time next_deadline() const;
  void advance_in_pieces();
  Time poll_due();
  Time poll_observers(Time now);
  Time observers_deadline() const;

  Console& console_;
  io::Warn warn_;
  io::Reactor reactor_;
  io::StopSignals signals_;
  bool clock_runs_;
  Time manual_now_ = 0;
  bool reads_input_;
  std::vector<std::unique_ptr<io::ParameterFile>> parameters_;
  std::optional<sim::ParameterCopies> copies_;  ///< of parameter files; none = they are written
  std::optional<session::Session> session_;
  std::vector<std::unique_ptr<BusConnections>> connections_;  ///< of each network
  std::vector<BusConnections*> connected_;                    ///< those that exist()
  std::optional<io::PcapFile> pcap_;
  bool stopping_ = false;
  bool is_behind_ = false;  ///< the plant, which has been reported
  bool observed_ = true;    ///< by more than Modbus clients: views, commands, buses, a manual clock
  std::list<io::StreamServer> commands_;
  std::list<io::StreamServer> bus_servers_;
  std::optional<io::ModbusTcp> modbus_;
  std::optional<io::ModbusSerial> rtu_;
  std::optional<io::StreamServer> rtu_tcp_;
  std::optional<io::HttpServer> http_;
  std::vector<std::string> command_;  ///< after --
  int command_error_ = STDERR_FILENO;
  std::optional<io::ChildProcess> child_;
};

}  // namespace cbcan::app

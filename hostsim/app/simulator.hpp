// SPDX-License-Identifier: MIT
#pragma once

/// cbcan-sim as a whole: CAN networks, Modbus servers, commands at run time, and the clock.

#include <unistd.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/bus_connections.hpp"
#include "app/clock.hpp"
#include "app/console.hpp"
#include "config/build_node.hpp"
#include "config/config.hpp"
#include "io/files/parameter_file.hpp"
#include "io/files/pcap_file.hpp"
#include "io/http/http_server.hpp"
#include "io/loop/child_process.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/stop_signals.hpp"
#include "io/modbus/modbus_rtu.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "plant/parameter_copies.hpp"
#include "session/session.hpp"

namespace cbcan::app {

/// A plant file as a path for a file that may be in any folder; "demo" and nothing stay as they are.
std::string absolute_plant(const std::string& plant_file);

class Simulator {
 public:
  /// The parameter files of modules and nodes: written, or as copies in memory.
  enum class Files : std::uint8_t { kWritten, kCopied };

  /// `build` is the result of config::build_nodes() for `config`. Opens everything; throws
  /// io::EnvironmentError, or io::UsageError for an invalid parameter file. `plant_file`: path, "demo" or
  /// empty. `reads_input`: see ManualClock.
  Simulator(const config::Config& config, config::PlantBuild build, const std::string& plant_file,
            Console& console, bool reads_input, Files files = Files::kWritten);

  /// Addresses of all that is served, with the real ports.
  session::Addresses addresses() const;

  /// Serves until SIGINT, SIGTERM or SIGHUP, or the clock's end. Throws what Clock::drive() throws.
  void run();
  /// Serves as long as the command runs, with the addresses in its environment, and returns its exit code.
  /// `error`: its standard error. Throws io::EnvironmentError if the process cannot be created.
  int run(const std::vector<std::string>& command, int error = STDERR_FILENO);

  /// Counters, in lines for people.
  std::string summary() const;

  // What the clock that drives it needs:
  bool stop_requested() const;
  /// The same during long work: polls signals first.
  bool stopped_meanwhile() { return signals_.poll(); }
  /// Does what is due, waits until `until` at most, and handles input; returns the number of inputs.
  std::size_t poll(Time until);
  /// Sends the output of it.
  void flush();
  session::Session& session() { return *session_; }
  /// Lets time pass on a manual clock.
  void pass(Time duration) { clock_->pass(*this, duration); }

 private:
  void start_command();
  void open_session(const config::Config& config, config::PlantBuild build, std::string plant_file,
                    Files files);
  plant::Plant& plant() { return session_->plant(); }
  void open_modbus(const config::Config& config);
  void open_views(const config::Config& config);
  void open_commands(const config::Config& config);
  void record(const std::string& path);
  session::Served served() const;
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
  std::unique_ptr<Clock> clock_;
  bool runs_;  ///< the clock
  std::vector<std::unique_ptr<io::ParameterFile>> parameters_;
  plant::ParameterCopies copies_;
  std::optional<session::Session> session_;
  std::vector<std::unique_ptr<BusConnections>> connections_;  ///< of each network
  std::vector<BusConnections*> connected_;                    ///< those that exist()
  std::optional<io::PcapFile> pcap_;
  bool stopping_ = false;
  bool is_behind_ = false;  ///< the plant, which has been reported
  bool observed_ = true;    ///< by more than Modbus clients: views, commands, buses, a manual clock
  std::optional<io::StreamServer> commands_;
  std::optional<io::ModbusTcp> modbus_;
  std::optional<io::ModbusSerial> rtu_;
  std::optional<io::StreamServer> rtu_tcp_;
  std::optional<io::HttpServer> http_;
  std::vector<std::string> command_;  ///< after --
  int command_error_ = STDERR_FILENO;
  std::optional<io::ChildProcess> child_;
};

}  // namespace cbcan::app

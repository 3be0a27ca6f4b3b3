// SPDX-License-Identifier: MIT
#pragma once

/// cbcan-sim as a whole: CAN networks, Modbus servers, commands at run time, and the clock.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adapters/command_session.hpp"
#include "app/bus_connections.hpp"
#include "app/clock.hpp"
#include "app/console.hpp"
#include "app/views.hpp"
#include "app/waits.hpp"
#include "config/build_node.hpp"
#include "config/config.hpp"
#include "io/files/parameter_file.hpp"
#include "io/http/http_server.hpp"
#include "io/loop/child_process.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/stop_signals.hpp"
#include "io/modbus/modbus_rtu.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "plant/plant.hpp"
#include "web/api.hpp"

namespace cbcan::app {

class Simulator final : private plant::NetworkListener {
 public:
  /// `build` is the result of config::build_nodes() for `config`. Opens everything; throws io::EnvironmentError,
  /// or io::UsageError for an invalid parameter file. `reads_input`: see ManualClock.
  Simulator(const config::Config& config, config::PlantBuild build, Console& console, bool reads_input);

  /// "modbus=127.0.0.1:1502 can=virtual slcan=127.0.0.1:29536 2/can=virtual", with the real ports, of all that is
  /// served.
  std::string where() const;
  /// Lines for people: commands by which programs join the buses.
  std::string ways_in() const;

  /// The plant that scenarios of this session name: a file, "demo" or none.
  void set_plant(const std::string& plant_file);
  /// Writes the session from now on as a scenario. Throws io::EnvironmentError.
  void record(const std::string& path) {
    recorder_.emplace(path, plant_file_, plant_->control(), find_name_);
  }

  /// Serves until SIGINT, SIGTERM or SIGHUP, or the clock's end. Throws what Clock::drive() throws.
  void run();
  /// Serves as long as the command runs, with the addresses in its environment, and returns its exit code. Throws
  /// io::EnvironmentError if the process cannot be created.
  int run(const std::vector<std::string>& command);

  /// Counters, in lines for people.
  std::string summary() const;

  // For the clock that drives it.
  bool stop_requested() const;
  /// The same during long work: polls signals first.
  bool stopped_meanwhile() { return signals_.poll(); }
  /// Does what is due, waits until `until` at most, and handles input; returns the number of inputs.
  std::size_t poll(Time until);
  /// Does what is due.
  void advance();
  /// Sends the output of it.
  void flush();
  /// The plant's next deadline.
  Time next_event() const { return plant_->next_deadline(); }
  /// A command of docs/reference/commands.md; its effects have happened when it returns the response, or when the
  /// response is available later, see adapters::Dialogue.
  std::string execute(std::string_view line, const std::shared_ptr<adapters::Dialogue>& dialogue);
  Waits& waits() { return waits_; }
  /// Answers waits that have ended; true if there was one.
  bool poll_waits();

 private:
  void open_plant(const config::Config& config, config::PlantBuild build);
  void open_modbus(const config::Config& config);
  void open_views(const config::Config& config);
  void open_commands(const config::Config& config);
  web::Json about() const;
  void poll_views();
  plant::Control& control() { return plant_->control(); }
  void advance_and_answer();
  void on_fault(std::size_t network, std::string_view text, Time now) override;
  void on_written(std::size_t network, const adapters::ModbusRange& written) override;
  void on_applied() override { poll_waits(); }
  void tell_time_of_day();
  std::string name_of(std::size_t network) const;
  std::string module_summary(const plant::Network& network) const;
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
  Time started_;
  std::vector<std::unique_ptr<io::ParameterFile>> parameters_;
  std::optional<plant::Plant> plant_;
  std::vector<std::unique_ptr<BusConnections>> connections_;  ///< of each network
  std::vector<BusConnections*> connected_;                    ///< those that exist()
  journal::FindName find_name_;
  std::string plant_file_;
  bool is_only_network_ = true;
  std::optional<Recorder> recorder_;
  std::optional<Trace> trace_;
  std::optional<io::PcapFile> pcap_;
  Waits waits_;
  bool stopping_ = false;
  bool is_behind_ = false;  ///< the plant, which has been reported
  bool observed_ = true;    ///< by more than Modbus clients: views, commands, buses, a manual clock
  std::optional<io::StreamServer> commands_;
  std::optional<io::ModbusTcp> modbus_;
  std::optional<io::ModbusSerial> rtu_;
  std::optional<io::StreamServer> rtu_tcp_;
  std::optional<web::Api> api_;
  std::optional<io::HttpServer> http_;
  std::optional<io::ChildProcess> child_;
};

}  // namespace cbcan::app

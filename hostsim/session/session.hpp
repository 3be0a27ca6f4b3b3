// SPDX-License-Identifier: MIT
#pragma once

/// A running plant and what is done with it: commands and their waits, views, the HTTP
/// interface, counters. Pure: time comes from outside, and messages go out through functions.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/build_node.hpp"
#include "config/config.hpp"
#include "plant/plant.hpp"
#include "protocols/dialogue.hpp"
#include "session/addresses.hpp"
#include "session/views.hpp"
#include "session/waits.hpp"
#include "web/api.hpp"

namespace cbcan::session {

inline constexpr std::string_view kBehind =
    "the plant is more than 1 s behind the clock: its nodes take more time than there is; let scripts be "
    "called less "
    "often, or use --clock manual";

/// Summary of the clients of one service at the bus, one line. `service`: "SLCAN".
std::string adapters_summary(std::string_view network, std::string_view service, std::uint64_t connections,
                             std::uint64_t lost);

/// What is served at present.
struct Served {
  Addresses addresses;
  std::uint64_t requests = 0;  ///< of Modbus TCP, as are these
  std::uint64_t exceptions = 0;
  std::uint64_t connections = 0;
  std::size_t clients = 0;
  bool http_may_write = false;
  std::size_t http_streams = 0;
};

/// What a session uses of the program around it; all of it outlives the session.
struct Host {
  const Time& now;                    ///< of the plant; never goes back
  bool clock_runs = true;             ///< else time passes by commands
  std::function<Time()> machine_now;  ///< this machine's clock
  Tell tell;                          ///< messages, as whole lines
  plant::Plant::FindStore store;
  std::function<void()> advance_buses;  ///< called before the plant is advanced
  std::function<void()> flush;          ///< sends what a command has caused, before its response
  std::function<Served()> served;
  std::function<void()> shut_down;
  std::function<void()> restart_command;  ///< that runs with the plant, if there is one
  std::function<void(Time)> let_pass;     ///< lets this time pass in the plant, while clients wait
};

class Session final : private plant::NetworkListener {
 public:
  /// `build` is the result of config::build_nodes() for `config`. `plant_file`: the plant that scenarios of
  /// this session name: an absolute path, "demo" or none.
  Session(const config::Config& config, config::PlantBuild build, std::string plant_file, Host host);

  plant::Plant& plant() { return plant_; }
  const plant::Plant& plant() const { return plant_; }
  plant::Control& control() { return plant_.control(); }
  Waits& waits() { return waits_; }
  const Waits& waits() const { return waits_; }
  const journal::FindName& find_name() const { return find_name_; }
  Time started() const { return started_; }
  /// Prefix of messages; empty if there is only one network.
  std::string name_of(std::size_t network) const;

  /// Writes the session from now on as a scenario.
  void record(Tell tell) { recorder_.emplace(control(), find_name_, plant_file_, std::move(tell)); }
  /// Called when time has passed, and after each Modbus request that writes; false = the program is to end.
  void watch(std::function<bool()> look) { look_ = std::move(look); }
  /// Serves the HTTP interface from now on. `config`: that of the constructor.
  web::Api& open_api(const config::Config& config);
  /// Views that have to be polled: lines of messages, a recording.
  bool has_views() const { return trace_ || recorder_; }
  void poll_views();
  /// A message, after those of the views.
  void warn(std::string_view line);

  /// Sets the devices' clocks; without this they start at midnight of 1984-01-01. `since_1970`: when the
  /// session was started.
  void set_time_of_day(Time since_1970);
  /// A client of Modbus TCP has connected or left.
  void on_client(std::uint32_t client, std::string_view address, bool joined);

  /// A command of docs/reference/commands.md; its effects have happened when it returns the response, or when
  /// the response is available later, see protocols::Dialogue.
  std::string execute(std::string_view line, const std::shared_ptr<protocols::Dialogue>& dialogue);
  /// Does what is due in the plant.
  void advance();
  /// Answers waits that have ended; true if there was one.
  bool poll_waits();
  /// The same, after what is due.
  void advance_and_answer();
  /// Where time goes next on a clock that does not run, while a wait wants it to.
  Time next_step() const;

  /// Counters, in lines for people.
  std::string summary() const;

 private:
  void on_fault(std::size_t network, std::string_view text, Time now) override;
  void on_written(std::size_t network, const modbus::Range& written) override;
  void on_applied() override { poll_waits(); }
  void on_plc_restart() override { host_.restart_command(); }
  void on_late_response(Time delay) override { host_.let_pass(delay); }
  web::Json about() const;
  std::string module_summary(const plant::Network& network) const;

  Host host_;
  std::string plant_file_;
  bool is_only_network_;
  Time started_;
  std::optional<Recorder> recorder_;  ///< it and trace_: the plant calls back while it is made
  std::optional<Trace> trace_;
  plant::Plant plant_;
  journal::FindName find_name_;
  Waits waits_;
  std::optional<web::Api> api_;
  std::function<bool()> look_;
};

}  // namespace cbcan::session

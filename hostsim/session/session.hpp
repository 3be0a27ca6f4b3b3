// SPDX-License-Identifier: MIT
#pragma once

/// A running plant and what is done with it: commands and their waits, views, the HTTP
/// interface, counters. Pure: time comes from outside, and messages go out through functions.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/address.hpp"
#include "base/buffer.hpp"
#include "base/error.hpp"
#include "config/build_node.hpp"
#include "config/config.hpp"
#include "plant/control.hpp"
#include "plant/plant.hpp"
#include "protocols/dialect.hpp"
#include "protocols/http_site.hpp"
#include "protocols/modbus_server.hpp"
#include "protocols/plc_polling.hpp"
#include "protocols/stream_session.hpp"
#include "scenario/scenario_writer.hpp"
#include "web/api.hpp"

namespace cbcan::session {

/// What a running plant is reached by: the line "ready ...", lines for people, the environment of a command.
struct Service {
  std::size_t network = 0;           ///< 0 = of all
  std::string_view name{};           ///< as in the line "ready ..."
  std::string listen{};              ///< as configured; empty = nothing listens
  std::string place{};               ///< with the real port; empty = it is not served
  protocols::MakeSession connect{};  ///< for each client; absent if the host has another way
  std::uint64_t connections = 0;     ///< of a bus service
  std::uint64_t lost = 0;            ///< frames that clients at the bus have not read in time
  bool has_warned = false;           ///< of browsers, which are turned away
};

/// All services, in the order of the line "ready ...".
class Services : public std::list<Service> {
 public:
  const Service& at(std::string_view name, std::size_t network = 0) const;
  Service& at(std::string_view name, std::size_t network = 0) {
    return const_cast<Service&>(std::as_const(*this).at(name, network));
  }

  /// "modbus=127.0.0.1:1502 can=virtual slcan=127.0.0.1:29536 2/can=virtual"
  std::string where() const;
  /// Lines for people: commands by which programs join the buses.
  std::string ways_in() const;
  /// "CBCAN_MODBUS=127.0.0.1:1502" and "CBCAN_SLCAN_2=..." of network 2
  std::vector<std::string> environment() const;
};

/// "slcan", of network 2 "2/slcan"
std::string key_of(const Service& service);

/// Commands that are answered later (docs/reference/commands.md: wait, pass). Those of closed connections are
/// dropped.
class Waits {
 public:
  using Dialogue = std::shared_ptr<protocols::Dialogue>;

  /// `machine_now`: this machine's clock.
  explicit Waits(std::function<Time()> machine_now) : machine_now_(std::move(machine_now)) {}

  /// The response of a command's reply; empty if it comes later.
  std::string take(plant::Reply reply, const Dialogue& dialogue);

  /// Answers those that have ended; true if there was one. The time is that of the Control.
  bool poll() { return !waiting_.empty() && poll_waiting(); }
  /// When one may end without an event, in the plant's time since its start; kNever = none.
  Time next_deadline() const {
    return sim::earliest(waiting_, [](const Waiting& waiting) { return waiting.wait->next_deadline(); });
  }

  bool exist() const { return !waiting_.empty(); }

  // What a manual clock needs:
  /// Whether one of them can end as time passes.
  bool want_time() const;
  /// No event can end any of them.
  bool are_passes() const;
  /// Time on this machine's clock when the first wait for the PLC reaches its limit; give_up_on_plc() ends it
  /// then.
  Time plc_deadline() const;
  void give_up_on_plc(Time now);

 private:
  struct Waiting {
    std::unique_ptr<plant::Wait> wait;
    std::weak_ptr<protocols::Dialogue> dialogue;
    Time since;  ///< on this machine's clock
  };

  bool poll_waiting();
  static void answer(const Waiting& waiting, const std::string& response);

  std::function<Time()> machine_now_;
  std::vector<Waiting> waiting_;
};

inline constexpr std::string_view kBehind =
    "the plant is more than 1 s behind the clock: its nodes take more time than there is; let scripts be "
    "called less "
    "often, or use --clock manual";

/// What is served at present by HTTP.
struct Served {
  bool http_may_write = false;
  std::size_t http_streams = 0;
};

/// The program around a session, which it outlives.
class Host {
 public:
  /// Time of the plant; never goes back. Always the same variable.
  virtual const Time& now() const = 0;
  /// False: time passes by commands.
  virtual bool clock_runs() const = 0;
  /// Time of this machine's clock.
  virtual Time machine_now() const = 0;
  /// Added to now() for the time since 1970, or for that since the start.
  virtual Time wall_offset() const = 0;
  /// Takes whole lines of messages.
  virtual void tell(std::string_view lines) = 0;
  /// Takes whole lines of results.
  virtual void say(std::string_view lines) = 0;
  /// Memory for the parameters of a module or node; null = none.
  virtual sim::ParameterStore* store(const std::string& file) = 0;
  /// Called before the plant is advanced.
  virtual void advance_buses() {}
  /// Sends what a command has caused, before its response.
  virtual void flush() {}
  virtual Served served() const = 0;
  virtual void shut_down() = 0;
  /// Ends the program because of a line of standard input.
  virtual void fail(base::ExitCode code, const std::string& why) = 0;
  /// Starts the command that runs with the plant again, if there is one.
  virtual void restart_command() {}
  /// Lets this time pass in the plant, while clients wait.
  virtual void let_pass(Time duration) = 0;

 protected:
  ~Host() = default;
};

class Session final : private plant::NetworkListener {
 public:
  /// `build` is the result of config::build_nodes() for `config`. `plant_file`: the plant that scenarios of
  /// this session name: an absolute path, "demo" or none.
  Session(const config::Config& config, config::PlantBuild build, std::string plant_file, Host& host);

  plant::Plant& plant() { return plant_; }
  const plant::Plant& plant() const { return plant_; }
  /// Starts the plant; views are added before. `observed`: see plant::Network::start().
  void start(bool observed);
  plant::Control& control() { return plant_.control(); }
  Waits& waits() { return waits_; }
  const Waits& waits() const { return waits_; }
  const journal::FindName& find_name() const { return find_name_; }
  Time started() const { return started_; }
  /// The networks, of which each that has a module is a unit; and the server of their clients by Modbus TCP.
  const std::vector<protocols::ModbusUnit*>& units() const { return units_; }
  protocols::ModbusServer& modbus() { return modbus_; }
  /// The services, with places that the host fills in; the session serves their clients, and HTTP by http().
  Services& services() { return services_; }
  const Services& services() const { return services_; }
  /// Prefix of messages; empty if there is only one network.
  std::string name_of(std::size_t network) const;

  /// Writes the session from now on as a scenario; `tell` takes whole lines.
  void record(std::function<void(std::string_view lines)> tell);
  /// Called when time has passed, and after each Modbus request that writes.
  void watch(std::function<void()> look) { look_ = std::move(look); }
  /// The HTTP interface, with events from now on. `config`: that of the constructor.
  protocols::HttpSite::Handler http(const config::Config& config);
  /// Views that have to be polled: lines of messages, a recording.
  bool has_views() const { return trace_ || recording_; }
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
  /// Executes a line of standard input, and says its response, now or by say_responses().
  void input(std::string_view line) { say(execute(line, input_)); }
  /// No further line is to be executed now.
  bool input_waits() const { return input_->waiting; }
  void say_responses() { say(std::exchange(input_->unsent, {})); }
  /// Does what is due in the plant.
  void advance();
  /// Answers waits that have ended; true if there was one.
  bool poll_waits();
  /// The same, after what is due.
  void advance_and_answer();
  // A clock that does not run; `now`: the host's variable for it.
  /// Lets time go on while a wait wants it to; true if one has ended.
  bool step(Time& now);
  void let_pass(Time duration, Time& now);

  /// Counters, in lines for people: of all, and of the clients at a network's bus.
  std::string summary() const;
  std::string clients_summary(std::size_t network) const;

 private:
  /// Lines for each ended transaction, state and EMCY message, and each frame if that is wanted.
  struct Trace {
    journal::Cursor cursor;
    base::Buffer lines{};
  };
  struct Recording {
    scenario::ScenarioWriter writer;
    journal::Cursor cursor;
    std::function<void(std::string_view lines)> tell;
  };

  void on_fault(std::size_t network, std::string_view text, Time now) override;
  void on_written(std::size_t network, const modbus::Range& written) override;
  void on_applied() override { poll_waits(); }
  void on_plc_restart() override { restarted_ = true, host_.restart_command(); }
  void on_late_response(Time delay) override { host_.let_pass(delay); }
  void list_services(const config::Config& config);
  void list_bus_services(const config::NetworkConfig& config);
  void poll_trace();
  void poll_recording();
  void say(const std::string& response);
  web::Json about() const;
  std::string module_summary(const plant::Network& network) const;

  Host& host_;
  const Time& now_;
  std::string plant_file_;
  bool is_only_network_;
  Time started_;
  std::optional<Recording> recording_;  ///< it and trace_: the plant calls back while it is made
  std::optional<Trace> trace_;
  plant::Plant plant_;
  journal::FindName find_name_;
  std::vector<protocols::ModbusUnit*> units_;
  protocols::ModbusServer modbus_;
  Waits waits_;
  Services services_;
  std::shared_ptr<protocols::Dialogue> input_ = std::make_shared<protocols::Dialogue>();
  std::function<void()> look_;
  bool restarted_ = false;  ///< the command, by the line that is executed
};

// ---- What the configuration says of a network's connections with the outside, whatever makes them

/// What is exchanged with the PLC that owns the registers of a network, which outlives it.
protocols::PlcPolling::Exchanges plc_exchanges(const config::NetworkConfig& config, plant::Network& network);
/// The place of a PLC that is not on a line. Throws base::UsageError.
base::ListenAddress plc_address(const config::PlcConfig& plc);

/// The text that an adapter speaks: SLCAN or socketcand.
std::unique_ptr<protocols::Dialect> dialect_of(const config::CanSpec& can);

}  // namespace cbcan::session

// SPDX-License-Identifier: MIT
#pragma once

/// cbcan-sim without an operating system: one plant, or one run of scenarios, for a host that has files,
/// connections and a clock. Bytes in and bytes out; nothing is called back.
///
/// A host calls start(). As long as the result names files that are missing, it gives these and starts again.
/// For a plant it then listens at the services, says by serve() where, and hands over what clients send. It
/// tells the time by pass(), and prints and writes what take_told() has.

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/command_line.hpp"
#include "config/run_options.hpp"
#include "protocols/bus_link.hpp"
#include "protocols/http_site.hpp"
#include "protocols/modbus_server.hpp"
#include "protocols/plc_polling.hpp"
#include "scenario/outcome.hpp"
#include "scenario/search/campaign.hpp"
#include "scenario/search/judge.hpp"
#include "session/session.hpp"
#include "sim/parameters.hpp"
#include "web/api.hpp"

namespace cbcan::module {

using web::Json;

class Instance final : private session::Host, private search::Host {
 public:
  using Environment = std::map<std::string, std::string>;

  Instance();
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  /// nullopt = there is none. The content of a folder: the files named *.toml in it and below, one a line.
  void give(std::string name, bool is_folder, std::optional<std::string> content);

  /// The arguments of a command line, without the program's name but with that of cbcan-eds or cbcan-network,
  /// the absolute path of the current folder, and the environment. Returns what is missing, {"files",
  /// "folders"}; or
  /// * {"exit"}: it has ended, with this code;
  /// * {"services"}: each has "name", "host" and "port" to listen at; "links": see join(); with "command",
  /// "manual" (the clock), "ready_to"
  ///   ("out" or "err"), "summary" (it is wanted at the end);
  /// * {"scenarios"}: their number; with "log" and "junit" as given;
  /// * {"search"}: see search(). It has "jobs" (0 = as many as there are processors), "budget" (microseconds
  ///   after which no trial is to begin), "state" and the size to which that file is to be cut, "cut_to", or
  ///   null, "out" and "junit" as given.
  Json start(const std::vector<std::string>& arguments, const std::string& folder, Environment environment);

  // ---- A plant

  /// Services and where they are now, "modbus 127.0.0.1:1502". Switches the plant on; `since_1970`: time of
  /// day. `alone`: there is one client, so on a manual clock a wait for the PLC lets time pass too. Returns
  /// {"ready", "ways_in", "environment"}.
  Json serve(const std::vector<std::string>& places, Time since_1970, bool alone);

  /// Lets time pass to `machine_now`, on this machine's clock from 0 on, and returns when it is to be called
  /// next. On a manual clock the plant's time passes as far as waits want it.
  Time pass(Time machine_now);

  /// The session of a new client; null = it is not served.
  std::unique_ptr<protocols::StreamSession> connect(const std::string& service, const std::string& peer);

  // ---- Streams that the host makes, and makes again

  /// A stream has been made. Each of "links" has "name" and "network", and "host" and "port", or "device",
  /// "baud" and "parity". Not for "plc", which has "unit".
  std::unique_ptr<protocols::StreamSession> join(const std::string& name, std::size_t network);
  /// It has ended, or could not be made.
  void lose(const std::string& name, std::size_t network, const std::string& why);
  /// With {"words"} or {"exception"}: the PLC has answered so. Else, if there is a connection: returns the
  /// next request, {"first", "count", "words"}, without words a read; or {"at"}: there is none before this
  /// time of this machine, unless time passes in the plant.
  Json plc(std::size_t network, const Json& outcome);

  /// HTTP: {"method", "path", "query", "body", "host", "origin", "last_event_id", "too_long"} to {"status",
  /// "headers", "body"}; instead of the body "stream", its number from 1, and "keep_alive", to be sent to an
  /// idle client.
  Json respond(const Json& request);
  /// {"text", "more"}: without more, the stream is complete.
  Json fill(unsigned stream);
  void drop(unsigned stream) { streams_.erase(stream); }

  /// A line of standard input, on a manual clock; not while the one before waits. An error ends the program.
  void input(std::string_view line) { session_->input(line); }
  bool input_waits() const { return session_->input_waits(); }

  std::string summary() const;

  // ---- Scenarios

  /// Plays scenario `place`, from 0. Returns what is missing, or {"log", "failed"}: names and texts,
  /// and how many have failed so far.
  Json play(std::size_t place);
  /// Verdict after all scenarios: {"exit", "junit"}
  Json played();
  /// Call it after play() without mistakes: plays scenario `place` on a plant of its own, which is served by
  /// HTTP then, on a manual clock.
  void show(std::size_t place);

  // ---- A search

  /// Goes on after `passed` on this machine's clock since it began. Returns {"trials", "progress", "kept"}:
  /// how many trials are missing, at most `most`, numbered from 0; and what is to be added to the file of
  /// --state. With "exit" and "junit" it has ended. Call it again after the trials, of which some may be left
  /// out.
  Json search(Time passed, std::size_t most);
  /// Makes a missing trial of a scenario.
  void try_here(std::size_t number);
  /// Makes a missing trial of another instance's command: returns {"services", "command"} as start(), or
  /// {"exit"}: it has ended. After "stop" no request is served, and the command is to be killed; after "end"
  /// it is to be ended, and after "restart" to be started again.
  Json begin_trial(Instance& search, std::size_t number);
  /// The command has ended with this code; `said` is the end of its standard error.
  void end_trial(int code, std::string_view said);
  /// The command of a missing trial has twice not ended within this time of this machine; `said`: see above.
  void hang(std::size_t number, Time limit, std::string_view said);

  /// What is to be printed or written since the last call: [to, text], where `to` is "out", "err", "end" (the
  /// text is the exit code) or a path; with a third element `true` the file is replaced, else the text is
  /// added.
  Json take_told();

 private:
  static constexpr std::string_view kOut = "out";
  static constexpr std::string_view kErr = "err";
  static constexpr std::string_view kEnd = "end";
  static constexpr std::string_view kRestart = "restart";
  static constexpr std::string_view kStop = "stop";

  class Parameters;
  class Log;
  class Bench;
  class RtuLine;
  /// The bus goes on at the other end of a stream.
  struct Outside final : sim::Outside {
    Outside(sim::Bus& inside, const std::string& spec, std::unique_ptr<protocols::Dialect> dialect,
            protocols::BusLink::Warn warn)
        : bus(inside), link(bus, "can " + spec + ": ", std::move(dialect), std::move(warn)) {
      bus.set_outside(this);
    }
    ~Outside() {
      bus.set_outside(nullptr);
      bus.resume();
    }
    bool transmit(const Frame& frame) override { return link.transmit(frame); }

    sim::Bus& bus;
    protocols::BusLink link;
  };
  struct Searching;

  std::optional<std::string> read(const std::string& path);
  Json missing();
  static Json ended(base::ExitCode code) { return {{"exit", static_cast<int>(code)}}; }
  void put(std::string_view to, std::string_view text, bool replace = false);
  void end(base::ExitCode code) { put(kEnd, std::to_string(static_cast<int>(code))); }

  const Time& now() const override { return now_; }
  bool clock_runs() const override { return start_.config.clock == config::ClockKind::kReal; }
  Time machine_now() const override { return machine_now_; }
  Time wall_offset() const override { return since_1970_; }
  void tell(std::string_view lines) override { put(kErr, lines); }
  void say(std::string_view lines) override { put(kOut, lines); }
  sim::ParameterStore* store(const std::string& file) override;
  session::Served served() const override;
  void shut_down() override { end(base::ExitCode::kDone); }
  void fail(base::ExitCode code, const std::string& why) override;
  void let_pass(Time duration) override { session_->let_pass(duration, now_); }
  void advance_buses() override;
  void restart_command() override { put(kRestart, ""); }
  void stop() {
    if (!std::exchange(stopping_, true)) put(kStop, "");
  }
  void show_progress(const std::string& progress) override { progress_ = progress; }
  Time searched() const override { return searched_; }
  std::string folder() const override { return folder_; }
  std::optional<std::string> variable(const std::string& name) const override {
    const auto found = environment_.find(name);
    return found == environment_.end() ? std::nullopt : std::optional(found->second);
  }
  void write(const std::string& path, const std::string& text) override { put(path, text, true); }

  Json start_plant(const std::vector<const char*>& words);
  Json start_scenarios(std::span<const char* const> words);
  Json start_generator(std::span<const char* const> words);
  config::Diagnostics not_here() const;
  void leave_files_alone(base::FileReader read);
  Json begin_search(const config::SearchConfig& options);
  Json search_command(search::Settings explored);
  Json search_scenarios();
  base::ExitCode go_on(std::size_t most);
  void open(config::PlantBuild build, std::string plant_file);
  Json services() const;
  Json open_links();
  Time poll_links();
  void open_service(std::string_view place);
  session::Service* find(std::string_view key);

  static constexpr int kMostSteps = 200;  ///< then clients have their turn

  void advance_to(Time end);
  void warn_if_behind(Time lag);
  void let_time_pass();
  Time next_event() const;
  bool want_time() const { return alone_ ? session_->waits().exist() : session_->waits().want_time(); }

  std::map<std::string, std::optional<std::string>> files_;
  std::map<std::string, std::optional<std::vector<std::string>>> folders_;
  std::set<std::string> missing_files_;
  std::set<std::string> missing_folders_;
  base::FileReader read_;
  Json told_ = Json::array();

  config::Start start_;
  std::string folder_;  ///< the current one
  Environment environment_;
  std::string plant_file_;  ///< as scenarios name it
  Time now_ = 0;  ///< of the plant
  Time machine_now_ = 0;
  Time lag_ = 0;  ///< of the plant behind the clock
  bool is_behind_ = false;
  Time since_1970_ = 0;
  bool alone_ = false;
  std::vector<std::unique_ptr<Parameters>> parameters_;
  std::optional<sim::ParameterCopies> copies_;  ///< of parameter files; none = they are written
  std::optional<session::Session> session_;
  std::vector<std::unique_ptr<Log>> logs_;
  std::map<std::size_t, std::unique_ptr<Outside>> outside_;  ///< by network, as plcs_
  std::map<std::size_t, protocols::PlcPolling> plcs_;
  protocols::RtuSession* rtu_ = nullptr;  ///< null = it is not open
  Time bus_deadline_ = kNever;
  std::optional<protocols::HttpSite> http_;
  std::map<unsigned, std::unique_ptr<protocols::HttpStream>> streams_;
  unsigned last_stream_ = 0;

  config::RunConfig run_;
  std::vector<std::string> scenarios_;
  std::vector<scenario::Outcome> outcomes_;
  config::EdsFiles eds_files_{read_};

  std::shared_ptr<Searching> searching_;
  Time searched_ = 0;
  std::string progress_;
  std::size_t trial_ = 0;  ///< that is made here
  std::unique_ptr<search::Judge> judge_;
  bool stopping_ = false;
};

}  // namespace cbcan::module

// SPDX-License-Identifier: MIT
#include "module/instance.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "base/command.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "config/command_line.hpp"
#include "config/plant_file.hpp"
#include "config/plant_settings.hpp"
#include "descriptions/generators.hpp"
#include "plant/control.hpp"
#include "scenario/run.hpp"
#include "scenario/scenario_writer.hpp"
#include "scenario/search/scenario_run.hpp"
#include "sim/frame_text.hpp"
#include "sim/parameters.hpp"

namespace cbcan::module {

namespace {

std::string message(std::string_view text) {
  return fmt::format("cbcan-sim: {}\n", base::to_utf8(text));
}

config::Diagnostic refused(const std::string& what, std::string_view instead) {
  return config::about_option(what, fmt::format("is not in this build; {}", instead));
}

/// Refuses the settings that need an operating system, if their value is not the default.
template <class Target>
void refuse(std::span<const base::Setting<Target>> rows, const Target& target, config::Diagnostics& found) {
  for (const base::Setting<Target>& row : rows) {
    const base::Value value = row.load(row, target);
    if (value == row.load(row, Target{})) continue;
    const std::string text = row.form == base::Form::kBoolean ? "" : " " + base::written(row, value);
    const std::string name(row.option.empty() ? row.key : base::option_name(row.option));
    const bool is_path =
        row.form == base::Form::kAddress && !base::parse_stream_address(text.substr(1)).path.empty();
    const bool is_stream = row.key == "can.spec" && !text.starts_with(" socketcan:");
    if (is_path || (!row.instead.empty() && !is_stream))
      found.push_back(refused(name + text, is_path ? "use HOST:PORT" : row.instead));
  }
}

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty())
    lines.emplace_back(base::take_line(text));
  return lines;
}

}  // namespace

/// The parameters of a node in a file of the host's.
class Instance::Parameters final : public sim::ParameterText {
 public:
  Parameters(Instance& instance, const std::string& path)
      : ParameterText(path, [&instance](const std::string& line) { instance.session_->warn(line); }),
        instance_(instance) {}

 private:
  std::optional<std::string> read() override { return instance_.read(path_); }
  bool write(const std::string& text) override {
    instance_.put(path_, text, true);
    return true;
  }

  Instance& instance_;
};

/// The frames of a bus as lines of candump.
class Instance::Log final : public sim::Observer {
 public:
  Log(std::function<void(const std::string&)> add, const Time& wall_offset)
      : add_(std::move(add)), wall_offset_(wall_offset) {}

  void on_bus_frame(const Frame& frame, Time now) override {
    sim::append_candump_line(text_, frame, now + wall_offset_, "virtual");
    if (text_.size() >= kCharactersPerWrite) flush();
  }
  void flush() {
    if (!text_.empty()) add_(std::exchange(text_, {}));
  }
  ~Log() { flush(); }

 private:
  static constexpr std::size_t kCharactersPerWrite = 65'536;

  std::function<void(const std::string&)> add_;
  const Time& wall_offset_;
  std::string text_;
};

/// The served plant, for a scenario: time passes as its steps want it.
class Instance::Bench final : public plant::Bench {
 public:
  explicit Bench(Instance& instance) : now_(instance.now_), session_(*instance.session_) {}

  plant::View& view() override { return session_.control(); }
  void check(std::string_view line) override { plant::check_command(line); }
  std::string execute(std::string_view line) override {
    const auto dialogue = std::make_shared<protocols::Dialogue>();
    std::string response = session_.execute(line, dialogue);
    while (dialogue->waiting)
      advance(session_.waits().next_deadline());
    return response + dialogue->unsent;
  }
  void advance(Time until) override {
    now_ = std::max(earlier(until, session_.plant().next_deadline()), now_);
    session_.advance_and_answer();
  }

 private:
  Time& now_;
  session::Session& session_;
};

Instance::Instance()
    : read_(config::with_demo_plant([this](const std::string& path) { return read(path); })) {}
Instance::~Instance() = default;

void Instance::give(std::string name, bool is_folder, std::optional<std::string> content) {
  if (is_folder)
    folders_[std::move(name)] = content ? std::optional(lines_of(*content)) : std::nullopt;
  else
    files_[std::move(name)] = std::move(content);
}

/// Continues without a missing file, so that all missing ones are found in one run.
std::optional<std::string> Instance::read(const std::string& path) {
  const auto found = files_.find(path);
  if (found != files_.end() && found->second && found->second->size() > base::kMostFileBytes)
    throw base::UsageError(path + base::kTooLong);
  if (found != files_.end()) return found->second;
  missing_files_.insert(path);
  return std::nullopt;
}

/// null = nothing.
Json Instance::missing() {
  if (missing_files_.empty() && missing_folders_.empty()) return {};
  return {{"files", std::exchange(missing_files_, {})}, {"folders", std::exchange(missing_folders_, {})}};
}

void Instance::put(std::string_view to, std::string_view text, bool replace) {
  const bool printed = to == kOut || to == kErr;
  Json told{to, printed ? base::lines_to_utf8(text) : std::string(text)};
  if (replace) told.push_back(true);
  told_.push_back(std::move(told));
}

Json Instance::take_told() {
  if (session_) session_->poll_views();
  for (const auto& log : logs_)
    log->flush();
  return std::exchange(told_, Json::array());
}

Json Instance::start(const std::vector<std::string>& arguments, const std::string& folder,
                     Environment environment) {
  session_.reset();
  told_ = Json::array();
  folder_ = folder;
  environment_ = std::move(environment);
  std::vector<const char*> words{"cbcan-sim"};
  for (const std::string& argument : arguments)
    words.push_back(argument.c_str());
  Json result;
  try {
    const std::string_view first = arguments.empty() ? "" : std::string_view(arguments.front());
    if (first.starts_with("cbcan-"))
      result = start_generator(std::span(words).subspan(1));
    else
      result = first == "run" ? start_scenarios(std::span(words).subspan(2)) : start_plant(words);
  } catch (const base::UsageError& error) {
    tell(message(error.what()));
    result = ended(base::ExitCode::kUsage);
  }
  Json needed = missing();
  return needed.is_null() ? result : needed;
}

/// Its output is text: that is all that a host gets.
Json Instance::start_generator(std::span<const char* const> words) {
  for (const std::string_view word : words)
    if (word == "--binary") throw base::UsageError("--binary: is not in this build; use the header");
  const descriptions::Generated made = descriptions::generate(words, read_);
  for (const std::string& remark : made.remarks)
    tell(remark + "\n");
  say(made.out);
  for (const auto& [path, content] : made.files) {
    put(path, "", true);
    put(path, content);
  }
  return ended(made.code);
}

// ---- A plant

Json Instance::start_plant(const std::vector<const char*>& words) {
  start_ = config::parse_command_line(static_cast<int>(words.size()), words.data(), read_);
  tell(start_.err);
  say(start_.out);
  if (!start_.run) return ended(start_.exit_code);
  const config::Diagnostics problems = not_here();
  for (const config::Diagnostic& problem : problems)
    tell(message(to_string(problem)));
  if (!problems.empty()) return ended(base::ExitCode::kUsage);
  search::Settings explored = search::read_settings(start_.plant_text, start_.plant_file);
  const search::Moments faults = search::only(start_.search.only, explored, start_.config);
  if (!start_.search.explore) search::inject(faults, start_.config);
  config::PlantBuild build = config::build_nodes(start_.config, eds_files_);
  for (const std::string& line : build.lines)
    tell((line.starts_with('-') ? "cbcan-sim: " : "") + line + "\n");
  if (!build.good) return ended(base::ExitCode::kUsage);
  plant_file_ = scenario::absolute_plant(start_.plant_file, folder_);
  const bool searches = start_.search.explore || !start_.search.seeds.empty();
  if (searches) leave_files_alone(build.read);
  open(std::move(build), plant_file_);
  if (start_.check)
    search::check_conditions(explored, start_.config, config::build_nodes(start_.config, eds_files_));
  if (start_.check) return ended(base::ExitCode::kDone);
  if (searches) return search_command(std::move(explored));
  return {{"services", services()},
          {"links", open_links()},
          {"command", start_.command},
          {"manual", start_.config.clock == config::ClockKind::kManual},
          {"ready_to", config::logs_to_standard_output(start_.config) ? kErr : kOut},
          {"summary", start_.config.summary || start_.config.verbose || start_.config.verbose_frames}};
}

config::Diagnostics Instance::not_here() const {
  config::Diagnostics found;
  refuse(config::kPlantSettings, start_.config, found);
  for (const config::NetworkConfig& network : start_.config.networks)
    refuse(config::kNetworkSettings, network, found);
  return found;
}

void Instance::open(config::PlantBuild build, std::string plant_file) {
  const config::Config& config = start_.config;
  outside_.clear();
  plcs_.clear();
  logs_.clear();
  parameters_.clear();
  session_.emplace(config, std::move(build), std::move(plant_file), static_cast<session::Host&>(*this));
  for (const config::NetworkConfig& network : config.networks) {
    if (network.log.empty()) continue;
    const std::string to = network.log == config::kStandardOutput ? std::string(kOut) : network.log;
    if (to != kOut) told_.push_back({to, "", {{"megabytes", network.log_mb}, {"continues", clock_runs()}}});
    logs_.push_back(
        std::make_unique<Log>([this, to](const std::string& text) { put(to, text); }, since_1970_));
    session_->plant().networks()[network.number - 1]->world().bus().observe(*logs_.back());
  }
  if (config.record.empty()) return;
  put(config.record, "", true);
  session_->record([this, path = config.record](std::string_view lines) { put(path, lines); });
}

/// Parameter files are copies, and logs are not written.
void Instance::leave_files_alone(base::FileReader read) {
  copies_.emplace(std::move(read));
  start_.config.record.clear();
  for (config::NetworkConfig& network : start_.config.networks)
    network.log.clear();
}

sim::ParameterStore* Instance::store(const std::string& file) {
  if (copies_) return copies_->find(file);
  return parameters_.emplace_back(std::make_unique<Parameters>(*this, file)).get();
}

// ---- Scenarios

Json Instance::start_scenarios(std::span<const char* const> words) {
  config::RunStart start = config::parse_run_command_line(words);
  tell(start.err);
  say(start.out);
  if (!start.run) return ended(start.exit_code);
  run_ = std::move(start.config);
  config::Diagnostics problems;
  refuse(config::kRunSettings, run_, problems);
  if (!problems.empty()) throw base::UsageError(to_string(problems.front()));
  const config::Shard shard =
      run_.explore ? config::Shard() : config::shard_of(run_.shard);  // of its moments
  const auto list = [this](const std::string& path) {
    const auto found = folders_.find(path);
    if (found == folders_.end()) missing_folders_.insert(path);
    return found == folders_.end() ? std::nullopt : found->second;
  };
  outcomes_.clear();
  scenarios_ = scenario::scenario_files(run_.paths, shard.part, shard.parts, list, read_);
  if (run_.explore) return search_scenarios();
  return {{"scenarios", scenarios_.size()}, {"log", run_.logs}, {"junit", run_.junit}};
}

Json Instance::play(std::size_t place) {
  const std::string& file = scenarios_[place];
  Json texts = Json::array();
  scenario::PlantRun run{run_.check, {}, {}};
  if (!run_.logs.empty())
    run.log = [&](std::size_t network) {
      const std::string name = scenario::log_name(file, network);
      texts.push_back({name, ""});
      return std::make_shared<Log>(
          [&texts, at = texts.size() - 1](const std::string& text) {
            texts[at][1].get_ref<std::string&>() += text;
          },
          since_1970_);
    };
  const config::Seeds seeds = run_.seeds.empty() ? config::Seeds{} : config::seeds_of(run_.seeds);
  scenario::SeedOutcomes outcomes;
  for (std::uint64_t seed = seeds.first; seed <= seeds.last; ++seed) {
    const auto chosen = run_.seeds.empty() ? std::nullopt : std::optional(static_cast<std::uint32_t>(seed));
    outcomes.add(static_cast<std::uint32_t>(seed),
                 scenario::play_file(file, chosen, read_, [&](scenario::Scenario& found) {
                   return search::play_once(found, eds_files_, run_, run);
                 }));
    if (Json needed = missing(); !needed.is_null()) return needed;
  }
  scenario::Outcome outcome = outcomes.sum("cbcan-sim run", file);
  say(report(file, outcome));
  outcomes_.push_back(std::move(outcome));
  const auto failed = std::ranges::count_if(outcomes_, &scenario::Outcome::is_failure);
  return {{"log", std::move(texts)}, {"failed", failed}};
}

Json Instance::played() {
  say(scenario::summary(outcomes_) + "\n");
  return {{"exit", static_cast<int>(exit_code_of(outcomes_))}, {"junit", junit(scenarios_, outcomes_)}};
}

void Instance::show(std::size_t place) {
  constexpr auto kPlace = "127.0.0.1:80";
  const scenario::Scenario scenario =
      scenario::read_scenario(read_(scenarios_[place]).value(), scenarios_[place], read_);
  start_.config = scenario.config;
  start_.config.clock = config::ClockKind::kManual;
  start_.config.http.listen = kPlace;
  open(config::build_nodes(start_.config, read_), "");
  serve({fmt::format("http {}", kPlace)}, 0, false);
  Bench bench(*this);
  scenario::play(scenario, bench);
}

}  // namespace cbcan::module

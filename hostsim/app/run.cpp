// SPDX-License-Identifier: MIT
#include "app/run.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "app/outcome.hpp"
#include "app/target.hpp"
#include "config/build_node.hpp"
#include "io/can/candump_log.hpp"
#include "io/loop/output.hpp"
#include "plant/virtual_plant.hpp"
#include "scenario/scenario.hpp"
#include "text/numbers.hpp"
#include "text/utf8.hpp"

namespace cbcan::app {

namespace {

namespace fs = std::filesystem;

/// The scenario files of this shard, each once, even if it is named several times.
std::vector<std::string> files_of(const cli::RunConfig& config, const config::FileReader& read) {
  std::vector<std::string> files;
  const auto has_steps = [&read](const std::string& path) {
    return ("\n" + read(path).value_or("")).find("\n[[step]]") != std::string::npos;
  };
  for (const std::string& path : config.paths) {
    std::error_code error;
    const std::size_t before = files.size();
    if (!fs::is_directory(path, error)) {
      files.push_back(path);
      continue;
    }
    for (const auto& entry : fs::recursive_directory_iterator(path))
      if (entry.path().extension() == ".toml" && entry.is_regular_file(error) &&
          has_steps(entry.path().string()))
        files.push_back(entry.path().lexically_normal().string());
    if (files.size() == before) throw io::UsageError(path + ": no file *.toml in it has a [[step]]");
  }
  std::ranges::sort(files);
  files.erase(std::unique(files.begin(), files.end()), files.end());
  const cli::Shard shard = cli::shard_of(config.shard);
  std::vector<std::string> part;
  for (std::size_t i = shard.part - 1; i < files.size(); i += shard.parts)
    part.push_back(files[i]);
  return part;
}

Outcome wrong(const config::Diagnostics& problems) {
  Outcome outcome{Verdict::kWrong, 0, {}};
  for (const config::Diagnostic& problem : problems)
    outcome.text += to_string(problem) + "\n";
  return outcome;
}

class Runner {
 public:
  Runner(const cli::RunConfig& config, const config::FileReader& read) : config_(config), read_(read) {}

  Outcome play(const std::string& file) const {
    const auto text = read_(file);
    if (!text) return wrong({{{file}, "cannot be read; check the path and its permissions"}});
    scenario::Scenario scenario = scenario::read_scenario(*text, file, read_);
    if (!scenario.problems.empty()) return wrong(scenario.problems);
    return config_.target.empty() ? play_on_plant(scenario) : play_on_target(std::move(scenario));
  }

 private:
  Outcome play_on_plant(const scenario::Scenario& scenario) const {
    config::PlantBuild build = config::build_nodes(scenario.config, read_);
    if (!build.good) {
      Outcome outcome{Verdict::kWrong, 0, {}};
      for (const std::string& line : build.lines)
        outcome.text += text::to_utf8(line) + "\n";
      return outcome;
    }
    plant::VirtualPlant plant(scenario.config, std::move(build), pace());
    if (const auto problems = check_steps(scenario, plant); !problems.empty()) return wrong(problems);
    if (config_.check) return {};
    const auto logs = open_logs(scenario.file, plant);
    plant.start();
    return play_on(scenario, plant);
  }

  Outcome play_on_target(scenario::Scenario scenario) const {
    Target target(cli::target_of(config_.target));
    std::size_t unseen = 0;
    try {
      unseen = leave_out_unobservable(scenario, target);
    } catch (const plant::NotObservable& step) {
      return {Verdict::kSkipped, 0, step.what()};
    }
    if (const auto problems = check_steps(scenario, target); !problems.empty())
      return {Verdict::kSkipped, 0, problems.front().message};
    Outcome outcome = play_on(scenario, target);
    if (unseen != 0 && outcome.verdict == Verdict::kPassed)
      outcome.text = fmt::format("{} expectations of nodes, frames or exact times left out", unseen);
    return outcome;
  }

  static Outcome play_on(const scenario::Scenario& scenario, plant::Bench& bench) {
    scenario::Played played = scenario::play(scenario, bench);
    return {played.failure.empty() ? Verdict::kPassed : Verdict::kFailed, played.duration,
            std::move(played.failure)};
  }

  plant::VirtualPlant::Pace pace() const {
    if (!config_.real_time) return {};
    auto reactor = std::make_shared<io::Reactor>();
    return [reactor, started = io::Reactor::now()](Time time) {
      while (io::Reactor::now() < started + time)
        reactor->poll(started + time);
    };
  }

  /// NAME.log, for network 2 NAME.2.log.
  std::vector<std::unique_ptr<io::CandumpLog>> open_logs(const std::string& file,
                                                         plant::VirtualPlant& plant) const {
    std::vector<std::unique_ptr<io::CandumpLog>> logs;
    for (std::size_t network = 1; network <= plant.control().networks() && !config_.logs.empty(); ++network) {
      const std::string number = network == 1 ? "" : fmt::format(".{}", network);
      const std::string path =
          (fs::path(config_.logs) / (fs::path(file).stem().string() + number + ".log")).string();
      logs.push_back(std::make_unique<io::CandumpLog>(path, "virtual", 0, [](const std::string&) {}));
      plant.control().world(network).bus().observe(*logs.back());
    }
    return logs;
  }

  const cli::RunConfig& config_;
  const config::FileReader& read_;
};

/// Shows progress on a terminal.
class Progress {
 public:
  explicit Progress(std::size_t all) : all_(all) {}
  ~Progress() { tell("\r\033[K"); }
  void done(const Outcome& outcome) {
    const std::scoped_lock lock(mutex_);
    failed_ += outcome.verdict == Verdict::kFailed || outcome.verdict == Verdict::kWrong ? 1 : 0;
    tell(fmt::format("\r{} of {}, {} failed", ++done_, all_, failed_));
  }

 private:
  static void tell(const std::string& text) {
    static const bool is_terminal = ::isatty(STDERR_FILENO) != 0;
    if (is_terminal && ::write(STDERR_FILENO, text.data(), text.size()) < 0) return;
  }
  std::mutex mutex_;
  std::size_t all_;
  std::size_t done_ = 0;
  std::size_t failed_ = 0;
};

/// config.jobs at a time: plants are independent of each other.
std::vector<Outcome> play_all(const std::vector<std::string>& files, const cli::RunConfig& config,
                              const config::FileReader& read) {
  const Runner runner(config, read);
  std::vector<Outcome> outcomes(files.size());
  Progress progress(files.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < files.size(); i = next++) {
      try {
        outcomes[i] = runner.play(files[i]);
      } catch (const std::exception& error) {
        outcomes[i] = {Verdict::kWrong, 0, text::to_utf8(error.what()) + "\n"};
      }
      progress.done(outcomes[i]);
    }
  };
  const std::size_t at_a_time = std::min<std::size_t>(config.jobs, files.size());
  std::vector<std::jthread> others(at_a_time - std::min<std::size_t>(at_a_time, 1));
  for (std::jthread& other : others)
    other = std::jthread(work);
  work();
  return outcomes;
}

}  // namespace

options::ExitCode run_scenarios(const cli::RunConfig& config, const config::FileReader& read,
                                Console& console) {
  std::error_code error;
  if (!config.logs.empty() && !fs::is_directory(config.logs, error))
    throw io::UsageError("--log " + config.logs + ": there is no such folder; make it first");
  const std::vector<std::string> files = files_of(config, read);
  std::optional<io::Output> results;
  if (!config.junit.empty()) results.emplace(io::Output::open("--junit", config.junit));
  const std::vector<Outcome> outcomes = play_all(files, config, read);
  for (std::size_t i = 0; i < files.size(); ++i)
    console.say(report(files[i], outcomes[i]));
  console.say(summary(outcomes) + "\n");
  if (results) results->add(junit(files, outcomes));
  if (const int wrong = results ? results->flush() : 0; wrong != 0)
    throw io::EnvironmentError("--junit " + config.junit + ": " + io::reason(wrong) + "; write another file");
  const auto any = [&](Verdict verdict) {
    return std::ranges::count(outcomes, verdict, &Outcome::verdict) != 0;
  };
  if (any(Verdict::kWrong)) return options::ExitCode::kUsage;
  return any(Verdict::kFailed) ? options::ExitCode::kCheckFailed : options::ExitCode::kDone;
}

}  // namespace cbcan::app

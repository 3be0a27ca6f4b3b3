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

#include "app/target.hpp"
#include "io/can/candump_log.hpp"
#include "io/loop/output.hpp"
#include "scenario/outcome.hpp"
#include "scenario/run.hpp"
#include "text/utf8.hpp"

namespace cbcan::app {

namespace {

namespace fs = std::filesystem;
using scenario::Outcome;
using scenario::Verdict;

std::optional<std::vector<std::string>> list_folder(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return std::nullopt;
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.path().extension() == ".toml" && entry.is_regular_file(error))
      files.push_back(entry.path().lexically_normal().string());
  return files;
}

class Runner {
 public:
  Runner(const cli::RunConfig& config, const config::FileReader& read) : config_(config), read_(read) {}

  Outcome play(const std::string& file) const {
    return scenario::play_file(file, read_, [this](scenario::Scenario& scenario) {
      return config_.target.empty() ? play_on_plant(scenario) : play_on_target(scenario);
    });
  }

 private:
  Outcome play_on_plant(const scenario::Scenario& scenario) const {
    scenario::PlantRun run{config_.check, pace(), {}};
    if (!config_.logs.empty())
      run.log = [this, &scenario](std::size_t network) {
        const std::string path = fs::path(config_.logs) / scenario::log_name(scenario.file, network);
        return std::make_shared<io::CandumpLog>(path, "virtual", 0, [](const std::string&) {});
      };
    return scenario::play_on_plant(scenario, read_, run);
  }

  Outcome play_on_target(scenario::Scenario& scenario) const {
    Target target(cli::target_of(config_.target));
    std::size_t unseen = 0;
    try {
      unseen = leave_out_unobservable(scenario, target);
    } catch (const plant::NotObservable& step) {
      return {Verdict::kSkipped, 0, step.what()};
    }
    if (const auto problems = check_steps(scenario, target); !problems.empty())
      return {Verdict::kSkipped, 0, problems.front().message};
    Outcome outcome = scenario::play_on_bench(scenario, target);
    if (unseen != 0 && outcome.verdict == Verdict::kPassed)
      outcome.text = fmt::format("{} expectations of nodes, frames or exact times left out", unseen);
    return outcome;
  }

  plant::VirtualPlant::Pace pace() const {
    if (!config_.real_time) return {};
    auto reactor = std::make_shared<io::Reactor>();
    return [reactor, started = io::Reactor::now()](Time time) {
      while (io::Reactor::now() < started + time)
        reactor->poll(started + time);
    };
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
  const cli::Shard shard = cli::shard_of(config.shard);
  const std::vector<std::string> files =
      scenario::scenario_files(config.paths, shard.part, shard.parts, list_folder, read);
  std::optional<io::Output> results;
  if (!config.junit.empty()) results.emplace(io::Output::open("--junit", config.junit));
  const std::vector<Outcome> outcomes = play_all(files, config, read);
  for (std::size_t i = 0; i < files.size(); ++i)
    console.say(report(files[i], outcomes[i]));
  console.say(summary(outcomes) + "\n");
  if (results) results->add(junit(files, outcomes));
  if (const int wrong = results ? results->flush() : 0; wrong != 0)
    throw io::EnvironmentError("--junit " + config.junit + ": " + io::reason(wrong) + "; write another file");
  return exit_code_of(outcomes);
}

}  // namespace cbcan::app

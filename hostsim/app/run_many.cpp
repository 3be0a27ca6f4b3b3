// SPDX-License-Identifier: MIT
#include "app/run_many.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>

#include "app/parallel.hpp"
#include "app/processes.hpp"
#include "app/state_file.hpp"
#include "io/loop/lines.hpp"
#include "io/loop/reactor.hpp"
#include "scenario/search/campaign.hpp"
#include "scenario/search/scenario_run.hpp"

namespace cbcan::app {

namespace {

/// Plays a scenario, each time on a plant of its own.
class Threads final : public search::Runner {
 public:
  /// Starts a thread for each of `files`.
  Threads(const scenario::Scenario& scenario, std::span<config::EdsFiles> files,
          const search::Settings& settings)
      : scenario_(scenario), files_(files), settings_(settings) {}

  void run_all(std::size_t count, const Make& make, const Wanted& wanted, const Ended& ended) override {
    std::mutex one;
    in_parallel(count, files_.size(), [&](std::size_t i, std::size_t thread) {
      if (!wanted()) return;
      const search::TrialReport report =
          search::play_or_problem(scenario_, make(i), settings_, files_[thread]);
      const std::scoped_lock lock(one);
      ended(i, report);
    });
  }

 private:
  const scenario::Scenario& scenario_;
  std::span<config::EdsFiles> files_;
  const search::Settings& settings_;
};

/// The program around a search.
class Surroundings final : public search::Host {
 public:
  /// Throws io::UsageError, io::EnvironmentError for a file or folder of the options.
  Surroundings(const config::SearchConfig& search, Console& console)
      : console_(console), kept_(open_state_file(search.state)) {
    if (!search.out.empty()) io::make_folder("--out", search.out);
    if (!search.junit.empty()) junit_.emplace("--junit", search.junit);
  }

  search::Kept& kept() { return *kept_; }
  base::ExitCode report(search::Campaign& campaign) {
    const base::ExitCode code = campaign.report();
    if (junit_) junit_->write(campaign.junit());
    return code;
  }

 private:
  void say(std::string_view lines) override { console_.say(lines); }
  void tell(std::string_view lines) override { console_.tell(lines); }
  void show_progress(const std::string& progress) override { progress_.show(progress); }
  Time searched() const override { return io::Reactor::now() - begun_; }
  std::string folder() const override { return std::filesystem::current_path().string(); }
  std::optional<std::string> variable(const std::string& name) const override {
    const char* const value = std::getenv(name.c_str());
    return value == nullptr ? std::nullopt : std::optional<std::string>(value);
  }
  void write(const std::string& path, const std::string& text) override {
    io::ResultFile("--out", path).write(text);
  }

  Console& console_;
  std::unique_ptr<search::Kept> kept_;
  std::optional<io::ResultFile> junit_;
  const Time begun_ = io::Reactor::now();
  Progress progress_;
};

}  // namespace

std::size_t at_a_time(const config::SearchConfig& search) {
  return search.jobs != 0 ? search.jobs : std::max(1U, std::thread::hardware_concurrency());
}

int run_many(const config::Start& start, const search::Settings& settings, config::EdsFiles& files,
             Console& console) {
  Processes runner(start, files, settings);
  Surroundings here(start.search, console);
  if (!start.search.explore) return static_cast<int>(search::run_seeds(start, runner, here));
  const auto campaign = search::make_campaign(start.search, here, here.kept());
  campaign->run(search::subject_of(start, settings, runner, here));
  return static_cast<int>(here.report(*campaign));
}

base::ExitCode explore_scenarios(const std::vector<std::string>& paths, const config::SearchConfig& search,
                                 const base::FileReader& read, Console& console) {
  std::vector<config::EdsFiles> files(at_a_time(search), config::EdsFiles(read));
  std::vector<search::Explored> all;
  for (const std::string& path : paths)
    all.push_back(search::read_explored(path, search.only, read));
  Surroundings here(search, console);
  const auto campaign = search::make_campaign(search, here, here.kept());
  for (const search::Explored& file : all) {
    Threads runner(file.scenario, files, file.settings);
    campaign->run(search::subject_of(file, search, files.front(), runner, here));
  }
  return here.report(*campaign);
}

}  // namespace cbcan::app

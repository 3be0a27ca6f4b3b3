// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "app/parallel.hpp"
#include "app/run_many.hpp"
#include "app/target.hpp"
#include "base/text.hpp"
#include "io/files/captures.hpp"
#include "io/loop/lines.hpp"
#include "scenario/outcome.hpp"
#include "scenario/run.hpp"
#include "scenario/search/scenario_run.hpp"

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
  Runner(const config::RunConfig& config, const base::FileReader& read) : config_(config), read_(read) {}

  Outcome play(const std::string& file, std::uint32_t seed, config::EdsFiles& files) const {
    const auto chosen = config_.seeds.empty() ? std::nullopt : std::optional(seed);
    return scenario::play_file(file, chosen, read_, [&](scenario::Scenario& scenario) {
      return config_.target.empty() ? play_here(scenario, files) : play_on_target(scenario);
    });
  }

 private:
  Outcome play_here(scenario::Scenario& scenario, config::EdsFiles& files) const {
    scenario::PlantRun run{config_.check, pace(), {}};
    if (!config_.logs.empty())
      run.log = [this, &scenario](std::size_t network) {
        const std::string path = fs::path(config_.logs) / scenario::log_name(scenario.file, network);
        return std::make_shared<io::CandumpLog>(io::CandumpLog::Settings{.path = path},
                                                [](const std::string&) {});
      };
    return search::play_once(scenario, files, config_, run);
  }

  Outcome play_on_target(scenario::Scenario& scenario) const {
    const auto target = open_target(config::target_of(config_.target));
    std::size_t unseen = 0;
    try {
      unseen = leave_out_unobservable(scenario, *target);
    } catch (const plant::NotObservable& step) {
      return {Verdict::kSkipped, 0, step.what()};
    }
    if (const auto problems = check_steps(scenario, *target); !problems.empty())
      return {Verdict::kSkipped, 0, problems.front().message};
    Outcome outcome = scenario::play(scenario, *target);
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

  const config::RunConfig& config_;
  const base::FileReader& read_;
};

/// The longest files first, so that at the end no processor waits for a long one.
std::vector<std::size_t> by_length(const std::vector<std::string>& files) {
  std::vector<std::pair<std::uintmax_t, std::size_t>> sizes;
  std::error_code error;
  for (std::size_t i = 0; i < files.size(); ++i)
    sizes.emplace_back(fs::file_size(files[i], error), i);
  std::ranges::stable_sort(sizes, std::greater{}, &std::pair<std::uintmax_t, std::size_t>::first);
  return base::column(sizes, &std::pair<std::uintmax_t, std::size_t>::second);
}

/// config.jobs at a time: plants are independent of each other.
std::vector<Outcome> play_all(const std::vector<std::string>& files, const config::RunConfig& config,
                              const base::FileReader& read) {
  const Runner runner(config, read);
  const config::Seeds seeds = config.seeds.empty() ? config::Seeds{} : config::seeds_of(config.seeds);
  const std::size_t of_each = std::size_t{seeds.last} - seeds.first + 1;
  const std::size_t all = files.size() * of_each;
  const std::vector<std::size_t> order = by_length(files);
  std::vector<scenario::SeedOutcomes> outcomes(files.size());
  const Progress progress;
  std::mutex one;
  std::size_t done = 0;
  std::size_t failed = 0;
  const std::size_t one_after_the_other =
      config.jobs != 0 ? config.jobs : 1;  // on a target, which keeps its state
  const std::size_t threads = config.target.empty() ? at_a_time(config) : one_after_the_other;
  std::vector<config::EdsFiles> eds_files(threads, config::EdsFiles(read));
  in_parallel(all, threads, [&](std::size_t i, std::size_t thread) {
    const std::size_t file = order[i / of_each];
    const auto seed = static_cast<std::uint32_t>(seeds.first + i % of_each);
    Outcome outcome = runner.play(files[file], seed, eds_files[thread]);
    const std::scoped_lock lock(one);
    failed += outcome.is_failure() ? 1U : 0U;
    progress.show(fmt::format("{} of {}, {} failed", ++done, all, failed));
    outcomes[file].add(seed, std::move(outcome));
  });
  std::vector<Outcome> of_files;
  for (std::size_t i = 0; i < files.size(); ++i)
    of_files.push_back(outcomes[i].sum("cbcan-sim run", files[i]));
  return of_files;
}

}  // namespace

base::ExitCode run_scenarios(const config::RunConfig& config, const base::FileReader& read,
                             Console& console) {
  if (!config.logs.empty()) io::make_folder("--log", config.logs);
  const config::Shard shard =
      config.explore ? config::Shard() : config::shard_of(config.shard);  // of its moments
  const std::vector<std::string> files =
      scenario::scenario_files(config.paths, shard.part, shard.parts, list_folder, read);
  if (config.explore) return explore_scenarios(files, config, read, console);
  std::optional<io::ResultFile> results;
  if (!config.junit.empty()) results.emplace("--junit", config.junit);
  const std::vector<Outcome> outcomes = play_all(files, config, read);
  for (std::size_t i = 0; i < files.size(); ++i)
    console.say(report(files[i], outcomes[i]));
  console.say(summary(outcomes) + "\n");
  if (results) results->write(junit(files, outcomes));
  return exit_code_of(outcomes);
}

}  // namespace cbcan::app

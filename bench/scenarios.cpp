// SPDX-License-Identifier: MIT
// What each scenario costs --explore.
#include <cstdio>

#include "base/read_file.hpp"
#include "bench.hpp"
#include "config/plant_file.hpp"
#include "scenario/search/scenario_run.hpp"

namespace cbcan::bench {

namespace {

/// One run after the other.
struct Here final : search::Runner {
  Here(const scenario::Scenario& played, const search::Settings& of_file, config::EdsFiles& of_plant)
      : scenario(played), settings(of_file), files(of_plant) {}
  void run_all(std::size_t count, const Make& make, const Wanted& /*wanted*/, const Ended& ended) override {
    for (std::size_t i = 0; i < count; ++i)
      ended(i, search::play(scenario, make(i), settings, files));
  }

  const scenario::Scenario& scenario;
  const search::Settings& settings;
  config::EdsFiles& files;
};

}  // namespace

void scenarios(const Arguments& arguments) {
  const base::FileReader read = config::with_demo_plant(base::read_file);
  config::EdsFiles files(read);
  double all = 0;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& path = arguments.word(i);
    const scenario::Scenario scenario = scenario::read_scenario(read(path).value_or(""), path, read);
    require(scenario.problems.empty(), path + " has mistakes");
    const search::Settings settings = search::read_settings(scenario.text, path);
    Here runner(scenario, settings, files);
    std::vector<std::string> faults = search::default_faults();
    std::erase(faults, search::kTypical);
    if (!settings.faults.empty()) faults.clear();
    search::Exploration exploration(scenario.config, settings, runner, faults, {});
    const double begun = processor_seconds();
    exploration.prepare();
    const auto& moments = exploration.moments();
    runner.run_all(
        moments.size(), [&](std::size_t run) { return exploration.trial_of(moments[run], false); }, {},
        [&](std::size_t /*run*/, const search::TrialReport& report) {
          require(report.problem.empty(), report.problem);
        });
    const double took = processor_seconds() - begun;
    const auto runs = static_cast<double>(moments.size() + 2);
    std::printf("%-44s %6.0f runs, %8.3f ms each, %7.3f s\n", path.c_str(), runs, took * 1e3 / runs, took);
    all += took;
  }
  std::printf("all: %.3f s of processor time\n", all);
}

}  // namespace cbcan::bench

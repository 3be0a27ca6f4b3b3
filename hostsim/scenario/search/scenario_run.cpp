// SPDX-License-Identifier: MIT
#include "scenario/search/scenario_run.hpp"

#include <utility>

#include "plant/virtual_plant.hpp"
#include "scenario/search/judge.hpp"

namespace cbcan::search {

TrialReport play(const scenario::Scenario& scenario, const Trial& trial, const Settings& settings,
                 config::EdsFiles& files) {
  config::PlantBuild build = config::build_nodes(trial.config, files);
  if (!build.good) return {.problem = build.lines.front(), .is_usage = true};
  plant::VirtualPlant plant(trial.config, std::move(build));
  Judge judge(plant.control(), settings, trial, [&](Time duration) {
    for (const Time end = plant.now() + duration; plant.now() < end; judge.keep_up())
      plant.advance(end);
  });
  plant.start();
  struct Over {};  // before the last step
  const auto look = [&judge] {
    if (!judge.look()) throw Over();
  };
  try {
    const scenario::Outcome played = scenario::play(scenario, plant, trial.baseline != nullptr, look);
    if (played.is_failure()) judge.fail(played.text);
  } catch (const Over&) {
  }
  TrialReport report = judge.end(std::nullopt);
  report.record.duration = 0;  // it ends by itself: no limit follows from it
  return report;
}

void check_conditions(const Settings& settings, const config::Config& config, config::PlantBuild build) {
  plant::VirtualPlant plant(config, std::move(build));
  const Trial trial{config};
  const Judge judge(plant.control(), settings, trial, {});
}

scenario::Outcome replay(const scenario::Scenario& scenario, const Moments& moments, const Settings& settings,
                         config::EdsFiles& files) {
  const TrialReport baseline = play(scenario, {scenario.config}, settings, files);
  const TrialReport disturbed =
      play(scenario, trial_with(moments, scenario.config, baseline.record), settings, files);
  for (const TrialReport* each : {&baseline, &disturbed})
    if (!each->problem.empty()) return {scenario::Verdict::kWrong, 0, each->problem + "\n"};
  if (!has_happened(moments, disturbed.result))
    return {scenario::Verdict::kFailed, disturbed.result.duration,
            to_string(moments) + ": " + std::string(kNeverHappened) + "\n"};
  const bool broken = disturbed.result.verdict == Verdict::kBroken;
  return {broken ? scenario::Verdict::kFailed : scenario::Verdict::kPassed, disturbed.result.duration,
          broken ? to_string(moments) + ": " + report(disturbed.result) : ""};
}

}  // namespace cbcan::search

// SPDX-License-Identifier: MIT
#include "scenario/search/scenario_run.hpp"

#include <fmt/core.h>

#include <utility>

#include "plant/plant.hpp"
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

TrialReport play_or_problem(const scenario::Scenario& scenario, const Trial& trial, const Settings& settings,
                            config::EdsFiles& files) try {
  return play(scenario, trial, settings, files);
} catch (const std::exception& error) {
  return {.problem = error.what(), .is_usage = true};  // the plant is in memory
}

void check_conditions(const Settings& settings, const config::Config& config, config::PlantBuild build) {
  plant::VirtualPlant plant(config, std::move(build));
  const Trial trial{config};
  const Judge judge(plant.control(), settings, trial, {});
}

scenario::Outcome play_once(scenario::Scenario& scenario, config::EdsFiles& files,
                            const config::RunConfig& config, const scenario::PlantRun& run) {
  const Settings settings = read_settings(scenario.text, scenario.file);
  const Moments faults = only(config.only, settings, scenario.config);
  if (faults.empty() || config.check) {
    scenario::Outcome outcome = scenario::play_on_plant(scenario, files, run);
    const bool has_conditions = !settings.always.empty() || !settings.done.empty() ||
                                !settings.gave_up.empty() || !settings.reached.empty();
    if (has_conditions && outcome.verdict == scenario::Verdict::kPassed)
      check_conditions(settings, scenario.config, config::build_nodes(scenario.config, files));
    return outcome;
  }
  if (!config.logs.empty())
    throw base::UsageError(fmt::format("--log {}: a run of --explore writes none", config.logs));
  return replay(scenario, faults, settings, files);
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

namespace {

constexpr std::uint32_t kMostTries = 16;  ///< of matching frames before the present one

bool is_same(const Result& result, const Failure& failure) {
  return result.verdict == Verdict::kBroken && result.what == failure.result.what;
}

/// Plays it with the faults of the failure, one of them as the matching frame with this number.
bool still_fails(const scenario::Scenario& scenario, Failure& failure, std::size_t place, std::uint32_t match,
                 const Record& baseline, const Settings& settings, config::EdsFiles& files) {
  Moments moments = failure.moments;
  moments[place].match = match;
  const TrialReport report = play(scenario, trial_with(moments, scenario.config, baseline), settings, files);
  if (!report.problem.empty() || !is_same(report.result, failure)) return false;
  failure.moments = std::move(moments);
  failure.result = report.result;
  return true;
}

/// Fewer steps mean fewer matching frames, so both change together.
bool take_out(std::size_t step, scenario::Scenario& scenario, Failure& failure, const Settings& settings,
              config::EdsFiles& files) {
  scenario::Scenario shorter = scenario;
  shorter.steps.erase(shorter.steps.begin() + static_cast<std::ptrdiff_t>(step));
  const TrialReport baseline = play(shorter, {scenario.config}, settings, files);
  if (!baseline.problem.empty() || baseline.result.verdict != Verdict::kDone) return false;
  for (std::size_t place = 0; place < failure.moments.size(); ++place) {
    const std::uint32_t now = failure.moments[place].match;
    for (std::uint32_t less = 0; less <= std::min(now, kMostTries); ++less) {
      if (now != 0 && less == now) break;
      if (!still_fails(shorter, failure, place, now - less, baseline.record, settings, files)) continue;
      scenario = std::move(shorter);
      return true;
    }
  }
  return false;
}

}  // namespace

Failure earlier(const Exploration& exploration, Runner& runner, Failure failure) {
  for (std::size_t place = 0; place < failure.moments.size(); ++place) {
    for (std::uint32_t distance = failure.moments[place].match; distance > 1; distance /= 2) {
      Moments moments = failure.moments;
      moments[place].match -= distance - 1;
      const TrialReport report = runner.run_one(exploration.trial_of(moments, false));
      if (!is_same(report.result, failure)) continue;
      failure.moments = std::move(moments);
      failure.result = report.result;
    }
  }
  return failure;
}

ShrunkScenario with_fewer_steps(const scenario::Scenario& scenario, const Failure& failure,
                                const Settings& settings, config::EdsFiles& files) {
  ShrunkScenario shrunk{scenario, failure};
  for (bool again = true; again;) {
    again = false;
    for (std::size_t step = shrunk.scenario.steps.size(); step-- != 0;)
      again = take_out(step, shrunk.scenario, shrunk.failure, settings, files) || again;
  }
  return shrunk;
}

}  // namespace cbcan::search

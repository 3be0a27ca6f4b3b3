// SPDX-License-Identifier: MIT
#pragma once

#include "config/build_node.hpp"
#include "config/run_options.hpp"
#include "scenario/outcome.hpp"
#include "scenario/run.hpp"
#include "scenario/scenario.hpp"
#include "scenario/search/exploration.hpp"

namespace cbcan::search {

/// Plays the steps of the scenario on the plant of the trial. With faults, only `must` is judged: a wait that
/// does not end goes on at its limit, and what is expected is not checked.
TrialReport play(const scenario::Scenario& scenario, const Trial& trial, const Settings& settings,
                 config::EdsFiles& files);

/// The same; what it throws is a problem of the report.
TrialReport play_or_problem(const scenario::Scenario& scenario, const Trial& trial, const Settings& settings,
                            config::EdsFiles& files);

/// Throws base::UsageError for a condition of [explore] that this plant does not have.
void check_conditions(const Settings& settings, const config::Config& config, config::PlantBuild build);

/// Plays the scenario on its plant, as `cbcan-sim run` does with this configuration: with the faults of
/// --only, or of its table [explore], as a run of --explore.
scenario::Outcome play_once(scenario::Scenario& scenario, config::EdsFiles& files,
                            const config::RunConfig& config, const scenario::PlantRun& run);

/// Plays a run of --explore again, and judges it in the same way.
scenario::Outcome replay(const scenario::Scenario& scenario, const Moments& moments, const Settings& settings,
                         config::EdsFiles& files);

// A failure becomes simpler: earlier faults, fewer steps. It is the same as long as the same condition is
// broken.

/// The same failure with its faults as early as possible, of those that are tried: the first matching frame,
/// and halvings of the way to it.
Failure earlier(const Exploration& exploration, Runner& runner, Failure failure);

struct ShrunkScenario {
  scenario::Scenario scenario;
  Failure failure;
};
/// The same failure of a scenario with as few steps as possible. The scenario passes without the faults.
ShrunkScenario with_fewer_steps(const scenario::Scenario& scenario, const Failure& failure,
                                const Settings& settings, config::EdsFiles& files);

}  // namespace cbcan::search

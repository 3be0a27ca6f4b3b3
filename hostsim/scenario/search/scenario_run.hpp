// SPDX-License-Identifier: MIT
#pragma once

#include "config/build_node.hpp"
#include "config/eds_file.hpp"
#include "scenario/outcome.hpp"
#include "scenario/scenario.hpp"
#include "scenario/search/exploration.hpp"

namespace cbcan::search {

/// Plays the steps of the scenario on the plant of the trial. With faults, only `must` is judged: a wait that
/// does not end goes on at its limit, and what is expected is not checked.
TrialReport play(const scenario::Scenario& scenario, const Trial& trial, const Settings& settings,
                 config::EdsFiles& files);

/// Throws base::UsageError for a condition of [explore] that this plant does not have.
void check_conditions(const Settings& settings, const config::Config& config, config::PlantBuild build);

/// Plays a run of --explore again, and judges it in the same way.
scenario::Outcome replay(const scenario::Scenario& scenario, const Moments& moments, const Settings& settings,
                         config::EdsFiles& files);

}  // namespace cbcan::search

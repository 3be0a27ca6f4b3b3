// SPDX-License-Identifier: MIT
#pragma once

/// Makes a failure simpler: earlier faults, fewer steps. It is the same as long as the same condition is
/// broken.

#include "config/eds_file.hpp"
#include "scenario/scenario.hpp"
#include "scenario/search/exploration.hpp"

namespace cbcan::search {

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

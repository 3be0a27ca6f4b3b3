// SPDX-License-Identifier: MIT
#pragma once

#include "config/eds_file.hpp"
#include "explore/exploration.hpp"
#include "scenario/scenario.hpp"

namespace cbcan::explore {

/// Plays the steps of the scenario on the plant of the run. With faults, only `must` is judged: a wait that
/// does not end goes on at its limit, and what is expected is not looked at.
Told play(const scenario::Scenario& scenario, const Run& run, const Settings& settings,
          config::EdsFiles& files);

}  // namespace cbcan::explore

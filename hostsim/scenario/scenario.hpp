// SPDX-License-Identifier: MIT
#pragma once

/// Scenarios: a plant and the steps of a test, in one TOML file (docs/reference/scenarios.md).

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.hpp"
#include "base/setting.hpp"
#include "config/config.hpp"
#include "plant/control.hpp"
#include "scenario/outcome.hpp"

namespace cbcan::scenario {

using base::Line;  // a command or a condition

struct Step {
  std::optional<Time> at;     ///< since the start
  std::optional<Time> after;  ///< since the end of the previous step
  std::optional<Time> every;  ///< period, to the end of the scenario
  std::vector<Line> commands;
  std::vector<Line> waits;
  std::optional<Time> within;  ///< for each wait; kWaitWithin unless set
  std::vector<Line> expectations;
  std::vector<Line> musts;  ///< expectations with and without faults
  std::size_t line = 0;
};

struct Scenario {
  std::string file;
  std::string text;  ///< of the file
  config::Config config;
  std::vector<Step> steps;
  config::Diagnostics problems;  ///< if not empty, the rest is not valid
};

/// The keys of a step, for the page.
extern const std::span<const base::Setting<Step>> kStepKeys;

/// The lines of a step under [[step]].
std::string text_of(const Step& step);

/// `read` reads the plant file that the scenario names, also that of the demo.
Scenario read_scenario(std::string_view text, const std::string& file, const base::FileReader& read);

/// Removes the expectations that cannot be observed on this bench; returns their number. Throws NotObservable
/// if nothing is left of a step.
std::size_t leave_out_unobservable(Scenario& scenario, plant::Bench& bench);

/// Mistakes in the steps, as far as they show without playing them.
config::Diagnostics check_steps(const Scenario& scenario, plant::Bench& bench);

/// The text of a failure: lines with place, expected and actual, registers, the last frames. Throws what the
/// bench throws. `disturbed`: faults have been added, so nothing but `musts` is a failure. `judge` is called
/// after each command, and when time has passed; what it throws ends the scenario. The report is then without
/// the messages of nodes and faults.
Outcome play(const Scenario& scenario, plant::Bench& bench, bool disturbed = false,
             const std::function<void()>& judge = {});

}  // namespace cbcan::scenario

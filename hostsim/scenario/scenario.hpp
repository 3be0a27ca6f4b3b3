// SPDX-License-Identifier: MIT
#pragma once

/// Scenarios: a plant and the steps of a test, in one TOML file. docs/reference/scenarios.md is the page
/// about them.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.hpp"
#include "config/files.hpp"
#include "plant/bench.hpp"
#include "plant/wait.hpp"
#include "options/setting.hpp"

namespace cbcan::scenario {

/// A command or a condition, and the line of the file that has it.
struct Line {
  std::string text;
  std::size_t number = 0;
};

struct Step {
  std::optional<Time> at;     ///< since the start
  std::optional<Time> after;  ///< since the step before was done
  std::optional<Time> every;  ///< from then on to the end
  std::vector<Line> commands;
  std::vector<Line> waits;
  std::optional<Time> within;  ///< for each wait; kWaitWithin unless set
  std::vector<Line> expectations;
  std::size_t line = 0;
};

struct Scenario {
  std::string file;
  config::Config config;
  std::vector<Step> steps;
  config::Diagnostics problems;  ///< with any, the rest is not to be used
};

/// The keys of a step, for the page.
std::span<const options::Row> step_rows();

/// `read` gives the plant file that the scenario names, the demo's too.
Scenario read_scenario(std::string_view text, const std::string& file, const config::FileReader& read);

/// Takes out the expectations of what this bench does not show; returns how many. Throws NotObservable where
/// nothing is left of a step.
std::size_t leave_out_unobservable(Scenario& scenario, plant::Bench& bench);

/// What is wrong with the steps, as far as that can be told without playing them on it.
config::Diagnostics check_steps(const Scenario& scenario, plant::Bench& bench);

struct Played {
  std::string failure;  ///< empty = passed; else lines: place, expected and seen, registers, the last frames
  Time duration = 0;    ///< of the plant's time
};

/// Plays it. Throws what the bench throws.
Played play(const Scenario& scenario, plant::Bench& bench);

}  // namespace cbcan::scenario

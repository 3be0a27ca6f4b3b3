// SPDX-License-Identifier: MIT
#pragma once

#include "config/plant_file.hpp"
#include "scenario/search/scenario_run.hpp"
#include "scenario/search/search.hpp"
#include "support/catch.hpp"
#include "support/complaint.hpp"

namespace cbcan::search::test {

inline const base::FileReader kRead =
    config::with_demo_plant([](const std::string&) { return std::nullopt; });

/// A scenario on the demo plant; `text` follows plant = "demo".
inline scenario::Scenario scenario_of(const std::string& text) {
  scenario::Scenario made = scenario::read_scenario("plant = \"demo\"\n" + text, "s.toml", kRead);
  for (const config::Diagnostic& problem : made.problems)
    FAIL(to_string(problem));
  return made;
}

/// A run of its steps without further faults, judged as one that has some, unless `baseline` is null.
inline TrialReport judged(const std::string& text, const Record* baseline, bool values_may_differ = false) {
  const scenario::Scenario scenario = scenario_of(text);
  config::EdsFiles files(kRead);
  const Trial trial{.config = scenario.config, .values_may_differ = values_may_differ, .baseline = baseline};
  return play(scenario, trial, read_settings(scenario.text, scenario.file), files);
}

}  // namespace cbcan::search::test

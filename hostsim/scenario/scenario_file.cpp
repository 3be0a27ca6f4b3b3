// SPDX-License-Identifier: MIT
// Reads a Scenario from TOML.
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/files.hpp"
#include "base/toml_table.hpp"
#include "config/plant_file.hpp"
#include "scenario/scenario.hpp"

namespace cbcan::scenario {

namespace {

constexpr std::string_view kStep = "step";

using base::setting;

constexpr auto kDuration = base::Form::kDuration;
constexpr std::string_view kTime = "a duration";
constexpr std::string_view kLines = "one or a list";
// clang-format off
constexpr auto kKeys = std::to_array<base::Setting<Step>>({
    setting<&Step::at>({.key = "at", .help = "Starts the step at this time of the plant", .form = kDuration, .domain = kTime}),
    setting<&Step::after>({.key = "after", .help = "Starts the step this time after the previous one", .form = kDuration, .domain = kTime}),
    setting<&Step::every>({.key = "every", .help = "Repeats `do` at this interval to the end of the scenario, while further steps run", .form = kDuration, .low = 1, .domain = kTime}),
    setting<&Step::commands>({.key = "do", .help = "[Commands](commands.md), in this order", .domain = kLines}),
    setting<&Step::waits>({.key = "wait", .help = "Conditions that are waited for, in this order", .domain = kLines}),
    setting<&Step::within>({.key = "within", .help = "Limit for each of them; 60 s by default", .form = kDuration, .domain = kTime}),
    setting<&Step::expectations>({.key = "expect", .help = "Conditions that hold at the end of the step; events count from the end of the previous one",
      .domain = kLines}),
    setting<&Step::musts>({.key = "must", .help = "The same, also with the faults of `--explore`", .domain = kLines}),
});
// clang-format on

void complain(Scenario& scenario, std::size_t line, std::string message) {
  scenario.problems.push_back({{scenario.file, line}, std::move(message)});
}

void read_step(const toml::table& table, Scenario& scenario) {
  Step& step = scenario.steps.emplace_back();
  step.line = base::line_of(table);
  base::read_table<Step>(table, kKeys, step, "step has", [&](std::size_t line, const std::string& mistake) {
    complain(scenario, line, "step." + mistake);
  });
  if (step.every &&
      (step.commands.empty() || !step.waits.empty() || !step.expectations.empty() || !step.musts.empty()))
    complain(scenario, step.line, "every: such a step has do, and none of wait, expect and must");
  if (step.at && step.after) complain(scenario, step.line, "at, after: a step has one of them");
}

void read_into(Scenario& scenario, std::string_view text, const base::FileReader& read) {
  const toml::table root = toml::parse(text, std::string_view(scenario.file));
  constexpr std::array kOthers{kStep};
  scenario.problems = config::read_plant(text, scenario.file, scenario.config, kOthers, &read);
  const toml::node* const steps = root.get(kStep);
  const toml::array* const list = steps != nullptr ? steps->as_array() : nullptr;
  if (list == nullptr || !std::ranges::all_of(*list, &toml::node::is_table))
    return complain(
        scenario, base::line_of(root),
        "step: there is none; write [[step]] above each step, or play a plant file with --config");
  for (const toml::node& step : *list)
    read_step(*step.as_table(), scenario);
}

}  // namespace

const std::span<const base::Setting<Step>> kStepKeys = kKeys;

std::string text_of(const Step& step) {
  return base::table_text<Step>(kKeys, step);
}

Scenario read_scenario(std::string_view text, const std::string& file, const base::FileReader& read) {
  Scenario scenario;
  scenario.file = file;
  scenario.text = text;
  std::string other = base::other_kind(file, text, base::kScenario);
  if (!other.empty() && !base::other_kind(file, text, base::kPlantFile).empty()) {
    complain(scenario, 0, std::move(other));
    return scenario;
  }
  try {
    read_into(scenario, text, read);
  } catch (const toml::parse_error&) {
    scenario.problems = config::read_plant(text, file, scenario.config);  // reports the mistake
  }
  if (scenario.problems.empty()) scenario.problems = config::check(scenario.config);
  config::sort_by_place(scenario.problems);
  return scenario;
}

}  // namespace cbcan::scenario

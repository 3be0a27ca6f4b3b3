// SPDX-License-Identifier: MIT
// Reads a Scenario from TOML.
#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <variant>

#include "config/demo_plant.hpp"
#include "config/plant_file.hpp"
#include "scenario/scenario.hpp"
#include "text/numbers.hpp"
#include "text/suggestion.hpp"
#include "text/words.hpp"

namespace cbcan::scenario {

namespace {

constexpr std::string_view kPlant = "plant";
constexpr std::string_view kStep = "step";
constexpr std::string_view kDemo = "demo";

constexpr std::string_view kDuration = "a duration";
constexpr std::string_view kLines = "one or a list";
/// A key of a step, and the member for it.
struct Key {
  options::Row row;
  std::variant<std::optional<Time> Step::*, std::vector<Line> Step::*> where;
};
// clang-format off
constexpr auto kKeys = std::to_array<Key>({
    {{.key = "at", .help = "Starts the step at this time of the plant", .domain = kDuration}, &Step::at},
    {{.key = "after", .help = "Starts the step this time after the previous one", .domain = kDuration}, &Step::after},
    {{.key = "every", .help = "Repeats `do` at this interval to the end of the scenario, while further steps run", .domain = kDuration}, &Step::every},
    {{.key = "do", .help = "[Commands](commands.md), in this order", .domain = kLines}, &Step::commands},
    {{.key = "wait", .help = "Conditions that are waited for, in this order", .domain = kLines}, &Step::waits},
    {{.key = "within", .help = "Limit for each of them; 60 s by default", .domain = kDuration}, &Step::within},
    {{.key = "expect", .help = "Conditions that hold at the end of the step; events count from the end of the previous one",
      .domain = kLines}, &Step::expectations},
});
// clang-format on

class Reader {
 public:
  Reader(Scenario& scenario, const config::FileReader& read) : scenario_(scenario), read_(read) {}

  void read(std::string_view text) {
    const toml::table root = toml::parse(text, std::string_view(scenario_.file));
    if (const toml::node* plant = root.get(kPlant)) read_plant_of(*plant);
    constexpr std::array kOthers{kPlant, kStep};
    append(config::read_plant(text, scenario_.file, scenario_.config, kOthers));
    const toml::node* const steps = root.get(kStep);
    const toml::array* const list = steps != nullptr ? steps->as_array() : nullptr;
    if (list == nullptr || !std::ranges::all_of(*list, &toml::node::is_table))
      return complain(root, "step: there is none; write [[step]] above each step");
    for (const toml::node& step : *list)
      read_step(*step.as_table());
  }

 private:
  void append(config::Diagnostics found) { std::ranges::move(found, std::back_inserter(scenario_.problems)); }

  void complain(const toml::node& where, std::string message) {
    scenario_.problems.push_back({{scenario_.file, where.source().begin.line}, std::move(message)});
  }

  void read_plant_of(const toml::node& node) {
    const auto* name = node.as_string();
    if (name == nullptr) return complain(node, "plant: must be a text: demo, or the path of a plant file");
    const std::string path =
        name->get() == kDemo ? std::string(config::kDemoPlant) : config::path_in(scenario_.file, name->get());
    if (const auto text = read_(path)) return append(config::read_plant(*text, path, scenario_.config));
    complain(node, fmt::format("plant {}: cannot be read; paths are relative to this file", path));
  }

  void read_step(const toml::table& table) {
    Step& step = scenario_.steps.emplace_back();
    step.line = table.source().begin.line;
    for (const auto& [key, node] : table)
      read_key(key.str(), node, step);
    if (step.every && (step.commands.empty() || !step.waits.empty() || !step.expectations.empty()))
      complain(table, "every: such a step has do, and neither wait nor expect");
    if (step.at && step.after) complain(table, "at, after: a step has one of them");
  }

  void read_key(std::string_view name, const toml::node& node, Step& step) {
    const auto key = std::ranges::find(kKeys, name, [](const Key& known) { return known.row.key; });
    if (key == kKeys.end()) return complain_of_key(name, node);
    if (const auto* duration = std::get_if<std::optional<Time> Step::*>(&key->where))
      read_duration(name, node, step.*(*duration));
    else
      read_lines(name, node, step.*std::get<std::vector<Line> Step::*>(key->where));
  }

  void complain_of_key(std::string_view key, const toml::node& node) {
    std::vector<std::string_view> known;
    for (const options::Row& row : step_rows())
      known.push_back(row.key);
    const std::string suggestion = text::did_you_mean(key, known);
    complain(node,
             fmt::format("step.{}: no such key{}", key,
                         suggestion.empty() ? "; a step has " + text::listed(known, " and ") : suggestion));
  }

  void read_duration(std::string_view key, const toml::node& node, std::optional<Time>& duration) {
    const auto* text = node.as_string();
    if (text != nullptr) duration = text::parse_duration(text->get());
    if (text == nullptr || !duration || (key == "every" && *duration == 0))
      complain(
          node,
          fmt::format("step.{0}: write {0} = \"100ms\": a whole number of us, ms or s, a year at most", key));
  }

  void read_lines(std::string_view key, const toml::node& node, std::vector<Line>& lines) {
    if (const auto* list = node.as_array())
      for (const toml::node& item : *list)
        read_line(key, item, lines);
    else
      read_line(key, node, lines);
  }

  void read_line(std::string_view key, const toml::node& node, std::vector<Line>& lines) {
    if (const auto* text = node.as_string())
      lines.push_back({text->get(), node.source().begin.line});
    else
      complain(node, fmt::format("step.{}: must be a text, or a list of them", key));
  }

  Scenario& scenario_;
  const config::FileReader& read_;
};

}  // namespace

std::vector<options::Row> step_rows() {
  std::vector<options::Row> rows;
  std::ranges::transform(kKeys, std::back_inserter(rows), &Key::row);
  return rows;
}

Scenario read_scenario(std::string_view text, const std::string& file, const config::FileReader& read) {
  Scenario scenario;
  scenario.file = file;
  try {
    Reader(scenario, read).read(text);
  } catch (const toml::parse_error&) {
    scenario.problems = config::read_plant(text, file, scenario.config);  // reports the mistake
  }
  if (scenario.problems.empty()) scenario.problems = config::check(scenario.config);
  config::sort_by_place(scenario.problems);
  return scenario;
}

}  // namespace cbcan::scenario

// SPDX-License-Identifier: MIT
#include "scenario/search/search_settings.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/error.hpp"
#include "base/text.hpp"
#include "base/toml_table.hpp"
#include "cbcan/mistakes.hpp"
#include "config/config.hpp"
#include "config/plant_settings.hpp"

namespace cbcan::search {

namespace {

using base::setting;

constexpr std::string_view kConditions = "conditions";
constexpr std::string_view kFaults = "faults";
constexpr std::string_view kTime = "a duration";
constexpr auto kDuration = base::Form::kDuration;

// clang-format off
constexpr auto kKeys = std::to_array<base::Setting<Settings>>({
    setting<&Settings::faults>({.key = "faults", .help = "Kinds with their keys, such as `response-*` or `power for_ms=300`; each acts once unless it has a count",
      .domain = kFaults}),
    setting<&Settings::nodes>({.key = "nodes", .help = "Nodes with faults; by default those that the run without faults spoke with", .high = 127, .domain = "node IDs"}),
    setting<&Settings::always>({.key = "always", .help = "Hold whenever time has passed, and after each Modbus request", .domain = kConditions}),
    setting<&Settings::done>({.key = "done", .help = "Hold at the end if the command ended with exit code 0", .domain = kConditions}),
    setting<&Settings::gave_up>({.key = "gave_up", .help = "Hold at the end if it ended with exit code 75", .domain = kConditions}),
    setting<&Settings::survive>({.key = "survive", .help = "Faults after which, once, giving up is a failure", .domain = kFaults}),
    setting<&Settings::reached>({.key = "reached", .help = "Happen in at least one run", .domain = kConditions}),
    setting<&Settings::only>({.key = "only", .help = "Faults that act in every run, such as `16:silent@149`; --explore writes them", .domain = "moments"}),
    setting<&Settings::advice>({.key = "advice", .help = "Advice that does not fail the run without faults, by name, or `ignore` for all", .domain = "names"}),
    setting<&Settings::environment>({.key = "environment", .help = "Variables that the command needs, for the command line in files of `--out`; `PYTHONPATH` is one", .domain = "names"}),
    setting<&Settings::ends>({.key = "ends", .help = "Faults come up to this time, then `settle` passes and the command is ended and done: for one without an end, as a PLC's", .form = kDuration, .domain = kTime}),
    setting<&Settings::settle>({.key = "settle", .help = "Passes in the plant between the end of the command and the last look", .form = kDuration, .domain = kTime}),
    setting<&Settings::within>({.key = "within", .help = "Limit of a run in the plant's time; by default ten times that of the run without faults",
      .form = kDuration, .domain = kTime}),
});
// clang-format on

}  // namespace

std::vector<std::string> default_faults() {
  const auto faults = base::words_of(
      "typical,response-*,abort,short-frame,refuse,request-lost,silent,silent count=0,"
      "heartbeat-stops count=0,power for_ms=300,power,bus-off for_ms=300,slow,cut,cut-before,late,exception,"
      "plc-restart,"
      "module-restart,module-nmt,module-nmt command=reset-comm,module-nmt command=stop,"
      "module-nmt command=preop,module-bus-off for_ms=300",
      ",");
  return {faults.begin(), faults.end()};
}

std::vector<std::string> default_survive() {
  return {"response-*", "request-lost", "plc-restart"};
}

const std::span<const base::Setting<Settings>> kExploreKeys = kKeys;

std::string text_of(const Settings& settings) {
  return base::table_text<Settings>(kKeys, settings);
}

Settings read_settings(std::string_view text, const std::string& file) {
  Settings settings;
  settings.file = file;
  if (text.find(config::kExploreTable) == std::string_view::npos) return settings;
  const auto fail = [&file](std::size_t line, const std::string& mistake) {
    throw base::UsageError(to_string(config::Diagnostic{{file, line}, "explore" + mistake}));
  };
  try {
    const toml::table root = toml::parse(text, std::string_view(file));
    const toml::node* const node = root.get(config::kExploreTable);
    if (const toml::table* const table = node != nullptr ? node->as_table() : nullptr)
      base::read_table<Settings>(
          *table, kKeys, settings, "explore has",
          [&fail](std::size_t line, const std::string& mistake) { fail(line, "." + mistake); });
    else if (node != nullptr)
      fail(base::line_of(*node), ": must be a table; write [explore]");
  } catch (const toml::parse_error&) {  // is reported by the plant's reader
  }
  std::vector<std::string_view> names = base::column(regmap::kMistakes, &regmap::NamedNumber::name);
  names.push_back(kIgnore);
  for (const Line& line : settings.advice)
    if (std::ranges::find(names, line.text) == names.end())
      fail(line.number, fmt::format(".advice: \"{}\": must be {}", line.text, base::listed(names)));
  return settings;
}

}  // namespace cbcan::search

// SPDX-License-Identifier: MIT
#include "scenario/search/search_settings.hpp"

#include <array>

#include "base/error.hpp"
#include "config/diagnostic.hpp"
#include "config/settings.hpp"
#include "scenario/line_table.hpp"

namespace cbcan::search {

namespace {

constexpr std::string_view kConditions = "conditions";
constexpr std::string_view kFaults = "faults";
constexpr std::string_view kDuration = "a duration";

// clang-format off
constexpr auto kKeys = std::to_array<scenario::LineKey<Settings>>({
    {{.key = "faults", .help = "Kinds with their keys, such as `response-*` or `power for_ms=300`; each acts once unless it has a count",
      .domain = kFaults}, &Settings::faults},
    {{.key = "nodes", .help = "Nodes with faults; by default those that the run without faults spoke with", .domain = "node IDs"},
     &Settings::nodes, true},
    {{.key = "always", .help = "Hold whenever time has passed, and after each Modbus request", .domain = kConditions}, &Settings::always},
    {{.key = "done", .help = "Hold at the end if the command ended with exit code 0", .domain = kConditions}, &Settings::done},
    {{.key = "gave_up", .help = "Hold at the end if it ended with exit code 75", .domain = kConditions}, &Settings::gave_up},
    {{.key = "survive", .help = "Faults after which, once, giving up is a failure", .domain = kFaults}, &Settings::survive},
    {{.key = "reached", .help = "Happen in at least one run", .domain = kConditions}, &Settings::reached},
    {{.key = "only", .help = "Faults that act in every run, such as `16:silent@149`; --explore writes them", .domain = "moments"}, &Settings::only},
    {{.key = "settle", .help = "Passes in the plant between the end of the command and the last look", .domain = kDuration}, &Settings::settle},
    {{.key = "within", .help = "Limit of a run in the plant's time; by default ten times that of the run without faults",
      .domain = kDuration}, &Settings::within},
});
// clang-format on

}  // namespace

std::vector<std::string> default_faults() {
  return {"response-*",
          "abort",
          "short-frame",
          "refuse",
          "request-lost",
          "silent",
          "silent count=0",
          "heartbeat-stops count=0",
          "power for_ms=300",
          "power",
          "bus-off for_ms=300",
          "slow",
          "cut",
          "cut-before",
          "late",
          "exception",
          "plc-restart",
          "module-restart",
          "module-nmt",
          "module-nmt command=reset-comm",
          "module-nmt command=stop",
          "module-nmt command=preop",
          "module-bus-off for_ms=300"};
}

std::vector<std::string> default_survive() {
  return {"response-*", "request-lost", "plc-restart"};
}

std::vector<base::Row> setting_rows() {
  return scenario::rows_of(std::span<const scenario::LineKey<Settings>>(kKeys));
}

std::string text_of(const Settings& settings) {
  return scenario::text_of(std::span<const scenario::LineKey<Settings>>(kKeys), settings);
}

Settings read_settings(std::string_view text, const std::string& file) {
  Settings settings;
  settings.file = file;
  if (text.find(config::kExploreTable) == std::string_view::npos) return settings;
  config::Diagnostics problems;
  try {
    const toml::table root = toml::parse(text, std::string_view(file));
    const toml::node* const node = root.get(config::kExploreTable);
    if (const toml::table* const table = node != nullptr ? node->as_table() : nullptr)
      scenario::LineTable(config::kExploreTable, file, problems)
          .read(*table, std::span<const scenario::LineKey<Settings>>(kKeys), settings);
    else if (node != nullptr)
      problems.push_back({{file, node->source().begin.line}, "explore: must be a table; write [explore]"});
  } catch (const toml::parse_error&) {  // is reported by the plant's reader
  }
  if (!problems.empty()) throw base::UsageError(to_string(problems.front()));
  return settings;
}

}  // namespace cbcan::search

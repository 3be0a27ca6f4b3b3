// SPDX-License-Identifier: MIT
#include "config/run_options.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "base/command.hpp"
#include "base/text.hpp"
#include "config/plant_settings.hpp"

namespace cbcan::config {

Seeds seeds_of(const std::string& text) {
  const std::size_t dots = std::min(text.find(".."), text.size());
  const auto first = base::parse<std::uint32_t>(text.substr(0, dots));
  const auto last = dots == text.size() ? first : base::parse<std::uint32_t>(text.substr(dots + 2));
  if (!first || !last || *first > *last)
    throw base::UsageError("must be A..B, such as 1..1000, or one number, of 0..4294967295");
  return {*first, *last};
}

Shard shard_of(const std::string& text) {
  const auto sides = base::split(text, '/');
  const auto part = sides ? base::parse<std::size_t>(sides->first) : std::nullopt;
  const auto parts = sides ? base::parse<std::size_t>(sides->second) : std::nullopt;
  if (!part || !parts || *part < 1 || *part > *parts)
    throw base::UsageError("must be I/N, the I-th part of N, such as 1/4");
  return {*part, *parts};
}

base::Problem check_budget(const base::Value& value) {
  return base::parse_duration(std::get<std::string>(value))
             ? ""
             : "must be a whole number of us, ms or s, such as 60s";
}

namespace {

using base::setting;

// clang-format off
constexpr std::array kOwnRows{
    setting<&RunConfig::logs>({.key = "run.log", .option = "--log FOLDER",
                           .help = "Writes the bus of each scenario there, in the format of candump -L",
                           .form = base::Form::kPath, .domain = "a path"}),
    setting<&RunConfig::real_time>({.key = "run.real_time", .option = "--real-time", .help = "Runs in real time", .instead = kUseProgram}),
    setting<&RunConfig::target>({.key = "run.target", .option = "--target HOST:PORT|rtu:DEV,BAUD,PARITY",
                             .help = "Plays on the registers of this Modbus server, in real time; expectations about nodes and frames are "
                                     "ignored, and scenarios that act on them are skipped",
                             .domain = "HOST:PORT or rtu:DEV,BAUD,PARITY", .instead = kUseProgram, .check = base::check_by<target_of>}),
    setting<&RunConfig::check>({.key = "run.check", .option = "--check", .help = "Only checks the files and reports mistakes"}),
};
constexpr std::array kRunWords{
    setting<&RunConfig::paths>({.key = "run.paths", .option = "FILE|FOLDER...",
                            .help = "Scenarios; of a folder all files *.toml that have a [[step]], in it and below"}),
};
// clang-format on

constexpr auto kRunRows = [] {
  constexpr auto kShared = search_rows<RunConfig>();
  std::array<base::Setting<RunConfig>, kShared.size() + kOwnRows.size()> rows{};
  std::ranges::copy(kOwnRows, std::ranges::copy(kShared, rows.begin()).out);
  return rows;
}();

constexpr base::Command<RunConfig> kRun{
    "cbcan-sim run", "plays scenarios; docs/reference/scenarios.md explains them", kRunWords, kRunRows};

}  // namespace

const std::span<const base::Setting<RunConfig>> kRunSettings = kRunRows;

TargetPlace target_of(const std::string& text) {
  constexpr std::uint16_t kModbusPort = 502;
  constexpr std::string_view kLine = "rtu:";
  if (!text.starts_with(kLine)) return {base::parse_listen_address(text, kModbusPort), {}};
  std::string_view rest = std::string_view(text).substr(kLine.size());
  TargetPlace place;
  place.line.device = base::take_part(rest, ',');
  const std::uint32_t baud = base::parse<std::uint32_t>(base::take_part(rest, ',')).value_or(0);
  place.line.parity = base::take_part(rest, ',');
  if (place.line.device.empty() || baud == 0 || place.line.parity.empty() || !rest.empty())
    throw base::UsageError("write rtu:DEV,BAUD,PARITY, such as rtu:/dev/ttyUSB0,19200,E");
  for (const auto& [key, value] : {std::pair("plc.baud", base::Value(std::int64_t{baud})),
                                   std::pair("plc.parity", base::Value(place.line.parity))})
    if (const auto problem = base::check(setting_of(kNetworkSettings, key), value); !problem.empty())
      throw base::UsageError(fmt::format("{}: {}", base::value_text(value), problem));
  place.line.baud = baud;
  return place;
}

RunStart parse_run_command_line(std::span<const char* const> words) {
  RunStart start;
  const base::ParsedArguments typed = base::parse_arguments(words, kRun);
  if (is_typed(typed, base::kHelpOption)) {
    start.out = base::help_of(kRun) + "\nExit codes:\n" + base::exit_code_lines("cbcan-sim");
    return start;
  }
  start.err = put_all(kRun, typed, start.config);
  for (const base::Row& row : kRunRows)
    if (start.err.empty() && !start.config.explore && row.help.starts_with("--explore:") &&
        is_typed(typed, base::option_name(row.option)))
      start.err = fmt::format("{} {}", base::option_name(row.option), kAddExplore);
  const std::string& seeds = start.config.seeds;
  const Seeds range = start.err.empty() && !seeds.empty() ? seeds_of(seeds) : Seeds();
  if (!start.config.logs.empty() && range.first != range.last)
    start.err =
        fmt::format("--log with --seeds {}: every run would write the same file; give one seed", seeds);
  start.run = start.err.empty();
  if (start.run) return start;
  start.exit_code = base::ExitCode::kUsage;
  start.err =
      fmt::format("cbcan-sim run: {}\ncbcan-sim run --help shows all options\n", base::to_utf8(start.err));
  return start;
}

}  // namespace cbcan::config

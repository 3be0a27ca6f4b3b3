// SPDX-License-Identifier: MIT
#include "cli/run_options.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "config/settings.hpp"
#include "options/command.hpp"
#include "text/address.hpp"
#include "text/error.hpp"
#include "text/numbers.hpp"
#include "text/utf8.hpp"
#include "text/words.hpp"

namespace cbcan::cli {

namespace {

options::Problem check_target(const text::Value& value) {
  return options::problem_of([&] { target_of(std::get<std::string>(value)); });
}

using options::setting;

// clang-format off
constexpr std::array kOwnRows{
    setting<&RunConfig::logs>({.key = "run.log", .option = "--log FOLDER",
                           .help = "Writes the bus of each scenario there, in the format of candump -L",
                           .form = options::Form::kPath, .domain = "a path"}),
    setting<&RunConfig::real_time>({.key = "run.real_time", .option = "--real-time", .help = "Runs in real time"}),
    setting<&RunConfig::target>({.key = "run.target", .option = "--target HOST:PORT|rtu:DEV,BAUD,PARITY",
                             .help = "Plays on the registers of this Modbus server, in real time; expectations about nodes and frames are "
                                     "ignored, and scenarios that act on them are skipped",
                             .domain = "HOST:PORT or rtu:DEV,BAUD,PARITY", .check = check_target}),
    setting<&RunConfig::check>({.key = "run.check", .option = "--check", .help = "Only checks the files and reports mistakes"}),
};
constexpr std::array kRunWords{
    setting<&RunConfig::paths>({.key = "run.paths", .option = "FILE|FOLDER...",
                            .help = "Scenarios; of a folder all files *.toml that have a [[step]], in it and below"}),
};
// clang-format on

constexpr auto kRunRows = [] {
  constexpr auto kShared = search_rows<RunConfig>();
  std::array<options::Setting<RunConfig>, kShared.size() + kOwnRows.size()> rows{};
  std::ranges::copy(kOwnRows, std::ranges::copy(kShared, rows.begin()).out);
  return rows;
}();

constexpr options::Command<RunConfig> kRun{
    "cbcan-sim run", "plays scenarios; docs/reference/scenarios.md explains them", kRunWords, kRunRows};

}  // namespace

TargetPlace target_of(const std::string& text) {
  constexpr std::uint16_t kModbusPort = 502;
  constexpr std::string_view kLine = "rtu:";
  if (!text.starts_with(kLine)) return {text::parse_listen_address(text, kModbusPort), {}};
  std::string_view rest = std::string_view(text).substr(kLine.size());
  TargetPlace place;
  place.line.device = text::take_part(rest, ',');
  const std::uint32_t baud = text::parse<std::uint32_t>(text::take_part(rest, ',')).value_or(0);
  place.line.parity = text::take_part(rest, ',');
  if (place.line.device.empty() || baud == 0 || place.line.parity.empty() || !rest.empty())
    throw text::UsageError("write rtu:DEV,BAUD,PARITY, such as rtu:/dev/ttyUSB0,19200,E");
  for (const auto& [key, value] : {std::pair("plc.baud", text::Value(std::int64_t{baud})),
                                   std::pair("plc.parity", text::Value(place.line.parity))})
    if (const auto problem = options::check(config::setting_of(config::network_settings(), key), value);
        !problem.empty())
      throw text::UsageError(fmt::format("{}: {}", text::value_text(value), problem));
  place.line.baud = baud;
  return place;
}

RunStart parse_run_command_line(std::span<const char* const> words) {
  RunStart start;
  std::vector<std::string_view> known{"-h, --help"};
  std::ranges::transform(kRunRows, std::back_inserter(known), &options::Row::option);
  const options::ParsedArguments typed = options::parse_arguments(words, known);
  if (is_typed(typed, options::kHelpOption)) {
    start.out = options::help_of(kRun) + "\nExit codes:\n" + options::exit_code_lines("cbcan-sim");
    return start;
  }
  for (const options::WrongWord& wrong : typed.wrong)
    if (start.err.empty()) start.err = fmt::format("{}: {}", wrong.word, wrong.message);
  if (start.err.empty()) start.err = put_options<RunConfig>(kRun, {}, typed, start.config);
  if (start.err.empty()) start.err = put_words(kRun, typed.words, start.config);
  const std::string& seeds = start.config.seeds;
  const Seeds range = start.err.empty() && !seeds.empty() ? seeds_of(seeds) : Seeds();
  if (!start.config.logs.empty() && range.first != range.last)
    start.err =
        fmt::format("--log with --seeds {}: every run would write the same file; give one seed", seeds);
  start.run = start.err.empty();
  if (start.run) return start;
  start.exit_code = ExitCode::kUsage;
  start.err =
      fmt::format("cbcan-sim run: {}\ncbcan-sim run --help shows all options\n", text::to_utf8(start.err));
  return start;
}

}  // namespace cbcan::cli

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

options::Problem check_shard(const text::Value& value) {
  return options::problem_of([&] { shard_of(std::get<std::string>(value)); });
}

options::Problem check_target(const text::Value& value) {
  return options::problem_of([&] { target_of(std::get<std::string>(value)); });
}

using options::setting;

// clang-format off
constexpr std::array kRunRows{
    setting<&RunConfig::junit>({.key = "run.junit", .option = "--junit FILE", .help = "Writes the results as JUnit XML",
                            .form = options::Form::kPath, .domain = "a path"}),
    setting<&RunConfig::logs>({.key = "run.log", .option = "--log FOLDER",
                           .help = "Writes the bus of each scenario there, in the format of candump -L",
                           .form = options::Form::kPath, .domain = "a path"}),
    setting<&RunConfig::jobs>({.key = "run.jobs", .option = "-j, --jobs N", .help = "Number of scenarios played at a time", .low = 1, .high = 1000}),
    setting<&RunConfig::shard>({.key = "run.shard", .option = "--shard I/N",
                            .help = "Plays part I of N, always the same scenarios",
                            .domain = "I/N", .check = check_shard}),
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

Shard shard_of(const std::string& text) {
  const auto sides = text::split(text, '/');
  const auto part = sides ? text::parse<std::size_t>(sides->first) : std::nullopt;
  const auto parts = sides ? text::parse<std::size_t>(sides->second) : std::nullopt;
  if (!part || !parts || *part < 1 || *part > *parts)
    throw text::UsageError("must be I/N, the I-th part of N, such as 1/4");
  return {*part, *parts};
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
  start.run = start.err.empty();
  if (start.run) return start;
  start.exit_code = ExitCode::kUsage;
  start.err =
      fmt::format("cbcan-sim run: {}\ncbcan-sim run --help shows all options\n", text::to_utf8(start.err));
  return start;
}

}  // namespace cbcan::cli

// SPDX-License-Identifier: MIT
#include "cli/run_options.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "cli/options.hpp"
#include "config/settings.hpp"
#include "text/address.hpp"
#include "text/arguments.hpp"
#include "text/error.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::cli {

namespace {

text::Problem check_shard(const text::Value& value) {
  const Shard shard = shard_of(std::get<std::string>(value));
  return shard.part == 0 ? "must be I/N, the I-th part of N, such as 1/4" : "";
}

text::Problem check_target(const text::Value& value) {
  try {
    target_of(std::get<std::string>(value));
    return {};
  } catch (const text::UsageError& error) {
    return error.what();
  }
}

template <auto kMember>
constexpr auto row(text::Row row) {
  return text::setting<RunConfig, kMember>(row);
}

// clang-format off
constexpr std::array kRunRows{
    row<&RunConfig::junit>({.key = "run.junit", .option = "--junit FILE", .help = "Writes the results as JUnit XML",
                            .form = text::Form::kPath, .domain = "a path"}),
    row<&RunConfig::logs>({.key = "run.log", .option = "--log FOLDER",
                           .help = "Writes the bus of each scenario there, in the format of candump -L",
                           .form = text::Form::kPath, .domain = "a path"}),
    row<&RunConfig::jobs>({.key = "run.jobs", .option = "-j, --jobs N", .help = "Number of scenarios played at a time", .low = 1, .high = 1000}),
    row<&RunConfig::shard>({.key = "run.shard", .option = "--shard I/N",
                            .help = "Plays part I of N, always the same scenarios",
                            .domain = "I/N", .check = check_shard}),
    row<&RunConfig::real_time>({.key = "run.real_time", .option = "--real-time", .help = "Runs in real time"}),
    row<&RunConfig::target>({.key = "run.target", .option = "--target HOST:PORT|rtu:DEV,BAUD,PARITY",
                             .help = "Plays on the registers of this Modbus server, in real time; expectations about nodes and frames are "
                                     "ignored, and scenarios that act on them are skipped",
                             .domain = "HOST:PORT or rtu:DEV,BAUD,PARITY", .check = check_target}),
    row<&RunConfig::check>({.key = "run.check", .option = "--check", .help = "Only checks the files and reports mistakes"}),
};
// clang-format on

constexpr std::string_view kRunOpening =
    R"(cbcan-sim run: plays scenarios; docs/reference/scenarios.md explains them

Usage:  cbcan-sim run [OPTION...] FILE|FOLDER...

Of a folder all files *.toml that have a [[step]], in it and below.

Options:
)";

std::string help() {
  std::string help(kRunOpening);
  for (const auto& setting : kRunRows)
    help += text::beside(setting.option, setting.help, 25);
  return help + text::beside("-h, --help", "Print this text", 25) + "\nExit codes:\n" +
         text::exit_code_lines("cbcan-sim");
}

std::vector<std::string_view> options() {
  std::vector<std::string_view> options{"-h, --help"};
  std::ranges::transform(kRunRows, std::back_inserter(options), &text::Row::option);
  return options;
}

/// Returns what is wrong.
std::string put(const text::Argument& argument, RunConfig& config) {
  for (const auto& setting : kRunRows) {
    if (text::option_name(setting.option) != argument.option) continue;
    const bool is_flag = setting.form == text::Form::kBoolean;
    const text::Problem problem =
        text::assign(setting, config, is_flag ? text::Value(true) : text::typed(setting, argument.text));
    if (!problem.empty()) return fmt::format("{} {}: {}", argument.option, argument.text, problem);
  }
  return {};
}

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
    if (const auto problem = text::check(config::setting_of(config::network_settings(), key), value);
        !problem.empty())
      throw text::UsageError(fmt::format("{}: {}", text::value_text(value), problem));
  place.line.baud = baud;
  return place;
}

Shard shard_of(const std::string& text) {
  const auto sides = text::split(text, '/');
  const auto part = sides ? text::parse<std::size_t>(sides->first) : std::nullopt;
  const auto parts = sides ? text::parse<std::size_t>(sides->second) : std::nullopt;
  if (!part || !parts || *part < 1 || *part > *parts) return {0, 0};
  return {*part, *parts};
}

std::span<const text::Setting<RunConfig>> run_settings() {
  return kRunRows;
}

RunStart parse_run_command_line(std::span<const char* const> words) {
  RunStart start;
  const text::ParsedArguments parsed = text::parse_arguments(words, options());
  if (std::ranges::count(parsed.options, kHelpOption, &text::Argument::option) != 0) {
    start.out = help();
    return start;
  }
  for (const text::WrongWord& wrong : parsed.wrong)
    if (start.err.empty()) start.err = fmt::format("{}: {}", wrong.word, wrong.message);
  for (const text::Argument& argument : parsed.options)
    if (start.err.empty()) start.err = put(argument, start.config);
  start.config.paths.assign(parsed.words.begin(), parsed.words.end());
  if (start.err.empty() && start.config.paths.empty())
    start.err = "there is nothing to run; name files or folders of scenarios";
  start.run = start.err.empty();
  if (start.run) return start;
  start.exit_code = ExitCode::kUsage;
  start.err = fmt::format("cbcan-sim run: {}\ncbcan-sim run --help shows all options\n", start.err);
  return start;
}

}  // namespace cbcan::cli

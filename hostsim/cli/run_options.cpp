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
#include "text/error.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::cli {

namespace {

using text::Problem;
using text::Row;
using text::Setting;

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
    row<&RunConfig::jobs>({.key = "run.jobs", .option = "-j, --jobs N", .help = "Number of processes", .low = 1, .high = 1000}),
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

const text::Setting<RunConfig>* find(std::string_view word) {
  const auto found = std::ranges::find_if(kRunRows, [word](const text::Row& setting) {
    return option_name(setting.option) == word || setting.option.substr(0, setting.option.find(',')) == word;
  });
  return found == kRunRows.end() ? nullptr : &*found;
}

/// Takes the word, and its argument, off the front. Returns what is wrong.
std::string take(std::span<const char* const>& words, RunConfig& config) {
  const std::string_view word = words.front();
  words = words.subspan(1);
  if (!word.starts_with('-')) return config.paths.emplace_back(word), "";
  const auto joined = text::split(word, '=');
  const auto* const setting = find(joined ? joined->first : word);
  if (setting == nullptr) {
    std::vector<std::string_view> known;
    std::ranges::transform(kRunRows, std::back_inserter(known), &text::Row::option);
    return fmt::format("{}: {}", word, no_such_option(word, std::move(known)));
  }
  const bool is_flag = setting->form == text::Form::kBoolean;
  if (!joined && !is_flag && words.empty()) return fmt::format("{}: needs an argument", word);
  std::string_view argument = is_flag ? "true" : "";
  if (joined) argument = joined->second;
  if (!joined && !is_flag) {
    argument = words.front();
    words = words.subspan(1);
  }
  const text::Problem problem = text::assign(*setting, config, text::typed(*setting, argument));
  return problem.empty() ? "" : fmt::format("{} {}: {}", option_name(setting->option), argument, problem);
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
  const auto is_help = [](std::string_view word) { return word == "-h" || word == kHelpOption; };
  if (std::ranges::any_of(words, is_help)) {
    start.out = help();
    return start;
  }
  while (!words.empty() && start.err.empty())
    start.err = take(words, start.config);
  if (start.err.empty() && start.config.paths.empty())
    start.err = "there is nothing to run; name files or folders of scenarios";
  start.run = start.err.empty();
  if (start.run) return start;
  start.exit_code = ExitCode::kUsage;
  start.err = fmt::format("cbcan-sim run: {}\ncbcan-sim run --help shows all options\n", start.err);
  return start;
}

}  // namespace cbcan::cli

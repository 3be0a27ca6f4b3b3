// SPDX-License-Identifier: MIT
#pragma once

/// Options of `cbcan-sim -- COMMAND` and `cbcan-sim run` for many runs of the same, and the command line of
/// `cbcan-sim run`, which plays scenarios.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/address.hpp"
#include "base/error.hpp"
#include "base/setting.hpp"
#include "config/config.hpp"

namespace cbcan::config {

struct SearchConfig {
  bool explore = false;
  std::string seeds;           ///< see seeds_of(); empty = random.seed
  std::string faults;          ///< kinds with commas between; empty = those of [explore]
  std::string nodes;           ///< with commas between; empty = those of [explore]
  std::uint16_t together = 1;  ///< faults in a run
  std::string only;            ///< moments; empty = all
  std::string shard = "1/1";   ///< see shard_of()
  std::uint16_t jobs = 0;      ///< runs at a time; 0 = as many as there are processors
  std::string budget;          ///< a duration on this machine's clock; empty = none
  std::string state;           ///< file with the results so far; empty = none
  std::string junit;           ///< file; empty = none
  std::string out;             ///< folder for files to play; empty = none
  bool list = false;           ///< moments only
};

/// Values of random.seed, one after the other.
struct Seeds {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
};
/// "A..B", or one number; throws base::UsageError.
Seeds seeds_of(const std::string& text);

/// Part and number of parts of SearchConfig::shard.
struct Shard {
  std::size_t part = 1;  ///< from 1
  std::size_t parts = 1;
};
/// Throws base::UsageError.
Shard shard_of(const std::string& text);

base::Problem check_budget(const base::Value& value);

inline constexpr std::string_view kAddExplore = "is for --explore; add it";
inline constexpr std::string_view kUseProgram = "use the program for Linux";

/// The rows of these options, for a Target that is, or has as a base, a SearchConfig.
template <class Target>
constexpr auto search_rows() {
  using base::setting;
  // clang-format off
  return std::array{
      setting<Target, &SearchConfig::explore>({.key = "search.explore", .option = "--explore",
          .help = "Runs it with each fault at each moment, and reports what breaks it; docs/how-to/explore.md"}),
      setting<Target, &SearchConfig::seeds>({.key = "search.seeds", .option = "--seeds A..B",
          .help = "Runs it with each of these numbers as random.seed", .domain = "A..B, or one number",
          .check = base::check_by<seeds_of>}),
      setting<Target, &SearchConfig::jobs>({.key = "search.jobs", .option = "-j, --jobs N",
          .help = "Number of runs at a time (default: as many as there are processors)", .low = 1, .high = 1000}),
      setting<Target, &SearchConfig::shard>({.key = "search.shard", .option = "--shard I/N",
          .help = "Does part I of N, always the same one", .domain = "I/N", .check = base::check_by<shard_of>}),
      setting<Target, &SearchConfig::junit>({.key = "search.junit", .option = "--junit FILE",
          .help = "Writes the results as JUnit XML", .form = base::Form::kPath, .domain = "a path"}),
      setting<Target, &SearchConfig::faults>({.key = "search.faults", .option = "--faults KIND,...",
          .help = "--explore: these faults, such as silent,power for_ms=300"}),
      setting<Target, &SearchConfig::nodes>({.key = "search.nodes", .option = "--nodes N,...", .help = "--explore: of these nodes"}),
      setting<Target, &SearchConfig::together>({.key = "search.together", .option = "--together N",
          .help = "--explore: up to so many faults near each other in a run", .low = 1, .high = 2}),
      setting<Target, &SearchConfig::only>({.key = "search.only", .option = "--only MOMENT",
          .help = "Runs it once, with the fault at this moment, such as 16:silent@149"}),
      setting<Target, &SearchConfig::budget>({.key = "search.budget", .option = "--budget DURATION",
          .help = "--explore: begins no run after this time, such as 60s", .domain = "a duration", .check = check_budget}),
      setting<Target, &SearchConfig::state>({.key = "search.state", .option = "--state FILE",
          .help = "--explore: keeps results there, and goes on from them", .form = base::Form::kPath, .domain = "a path"}),
      setting<Target, &SearchConfig::out>({.key = "search.out", .option = "--out FOLDER",
          .help = "--explore: writes a file for each failure there, which plays it", .form = base::Form::kPath, .domain = "a path"}),
      setting<Target, &SearchConfig::list>({.key = "search.list", .option = "--list", .help = "--explore: only lists the moments"}),
  };
  // clang-format on
}

struct RunConfig : SearchConfig {
  std::vector<std::string> paths;  ///< of files and folders
  std::string logs;                ///< folder; empty = none
  std::string target;              ///< see target_of(); empty = the plant of each scenario
  bool real_time = false;
  bool check = false;
};

/// The Modbus server whose registers scenarios are played on.
struct TargetPlace {
  base::ListenAddress server;  ///< of Modbus TCP
  LineConfig line;             ///< of Modbus RTU, station 1; without a device `server` is used
};
/// "HOST:PORT" or "rtu:DEV,BAUD,PARITY"; throws base::UsageError.
TargetPlace target_of(const std::string& text);

extern const std::span<const base::Setting<RunConfig>> kRunSettings;

struct RunStart {
  bool run = false;
  base::ExitCode exit_code = base::ExitCode::kDone;  ///< if not run
  std::string out;
  std::string err;
  RunConfig config;
};

/// `words`: those after "run".
RunStart parse_run_command_line(std::span<const char* const> words);

}  // namespace cbcan::config

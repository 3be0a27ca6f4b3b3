// SPDX-License-Identifier: MIT
#pragma once

/// The command line of `cbcan-sim run`, which plays scenarios.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "cli/command_line.hpp"
#include "config/config.hpp"
#include "options/setting.hpp"
#include "text/address.hpp"

namespace cbcan::cli {

struct RunConfig {
  std::vector<std::string> paths;  ///< of files and folders
  std::string junit;               ///< file; empty = none
  std::string logs;                ///< folder; empty = none
  std::uint16_t jobs = 1;          ///< scenarios at a time
  std::string shard = "1/1";
  std::string target;  ///< see target_of(); empty = the plant of each scenario
  bool real_time = false;
  bool check = false;
};

/// The Modbus server whose registers scenarios are played on.
struct TargetPlace {
  text::ListenAddress server;  ///< of Modbus TCP
  config::LineConfig line;     ///< of Modbus RTU, station 1; without a device `server` is used
};
/// "HOST:PORT" or "rtu:DEV,BAUD,PARITY"; throws text::UsageError.
TargetPlace target_of(const std::string& text);

/// Part and number of parts of a RunConfig::shard.
struct Shard {
  std::size_t part = 1;  ///< from 1
  std::size_t parts = 1;
};
/// Throws text::UsageError.
Shard shard_of(const std::string& text);

struct RunStart {
  bool run = false;
  ExitCode exit_code = ExitCode::kDone;  ///< if not run
  std::string out;
  std::string err;
  RunConfig config;
};

/// `words`: those after "run".
RunStart parse_run_command_line(std::span<const char* const> words);

}  // namespace cbcan::cli

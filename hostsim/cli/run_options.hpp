// SPDX-License-Identifier: MIT
#pragma once

/// The command line of `cbcan-sim run`, which plays scenarios.

#include <span>
#include <string>
#include <vector>

#include "cli/command_line.hpp"
#include "cli/search_options.hpp"
#include "config/config.hpp"
#include "options/setting.hpp"
#include "text/address.hpp"

namespace cbcan::cli {

struct RunConfig : SearchConfig {
  std::vector<std::string> paths;  ///< of files and folders
  std::string logs;                ///< folder; empty = none
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

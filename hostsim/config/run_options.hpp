// SPDX-License-Identifier: MIT
#pragma once

/// The command line of `cbcan-sim run`, which plays scenarios.

#include <span>
#include <string>
#include <vector>

#include "base/address.hpp"
#include "base/setting.hpp"
#include "config/command_line.hpp"
#include "config/config.hpp"
#include "config/search_options.hpp"

namespace cbcan::config {

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
  ExitCode exit_code = ExitCode::kDone;  ///< if not run
  std::string out;
  std::string err;
  RunConfig config;
};

/// `words`: those after "run".
RunStart parse_run_command_line(std::span<const char* const> words);

}  // namespace cbcan::config

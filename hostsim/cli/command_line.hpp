// SPDX-License-Identifier: MIT
#pragma once

/// The command line of `cbcan-sim`: which plant to read, and what is to be different from it. What it offers
/// is in --help (help.cpp).

#include <string>
#include <vector>

#include "config/config.hpp"
#include "config/files.hpp"
#include "options/exit_code.hpp"

namespace cbcan::cli {

using options::ExitCode;

/// What main() does first: print `out` and `err`, then run with `config`, or leave with `exit_code`.
struct Start {
  bool run = false;
  bool check = false;  ///< nothing is to be opened or served: only said what is wrong with the nodes
  ExitCode exit_code = ExitCode::kDone;  ///< if not run
  std::string out;                       ///< for standard output: help, version
  std::string err;                       ///< for standard error: all that is wrong, or remarks on a run
  config::Config config;
  std::string plant_file;  ///< that it has been read from, "demo", or empty
  /// What stands behind "--": a program and its arguments, to be run with the plant at free addresses of this
  /// machine, but for those that options name.
  std::vector<std::string> command;
};

/// `argv[0]` is the program's name. `read` gives plant files, the demo's too (with_demo_plant()); EDS files
/// are not opened here.
Start parse_command_line(int argc, const char* const* argv, const config::FileReader& read);

}  // namespace cbcan::cli

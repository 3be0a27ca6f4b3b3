// SPDX-License-Identifier: MIT
#pragma once

/// The command line of `cbcan-sim`: the plant to read, and the settings that replace those of the plant.

#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/files.hpp"
#include "config/config.hpp"
#include "config/run_options.hpp"

namespace cbcan::config {

using base::ExitCode;

/// main() prints `out` and `err`, then runs with `config` or ends with `exit_code`.
struct Start {
  bool run = false;
  bool check = false;                    ///< open and serve nothing, only report mistakes
  ExitCode exit_code = ExitCode::kDone;  ///< if not run
  std::string out = {};                  ///< for standard output: help, version
  std::string err = {};                  ///< for standard error: all mistakes, or remarks on a run
  Config config = {};
  std::string plant_file = {};  ///< path, "demo", or empty
  /// The program and its arguments after "--". It runs with the plant at free addresses of this machine,
  /// except for addresses from options.
  std::vector<std::string> command = {};
  SearchConfig search = {};             ///< of the command
  std::vector<std::string> words = {};  ///< all others, apart from those for `search`
  std::string plant_text = {};          ///< of plant_file
};

/// `argv[0]` is the program's name. `read` reads plant files, also that of the demo (with_demo_plant()); EDS
/// files are not opened here.
Start parse_command_line(int argc, const char* const* argv, const base::FileReader& read);

/// Output of `cbcan-sim eds --help`.
std::string eds_help_text();

}  // namespace cbcan::config

// SPDX-License-Identifier: MIT
#pragma once

/// The command line of `cbcan-sim`: the plant to read, and the settings that replace those of the plant.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/command.hpp"
#include "base/error.hpp"
#include "base/files.hpp"
#include "config/config.hpp"
#include "config/run_options.hpp"

namespace cbcan::config {

/// Options that belong to no single setting; their keys begin with their section of --help.
extern const std::span<const base::Row> kOptionRows;

/// Options for many runs of a command.
extern const std::span<const base::Setting<SearchConfig>> kSearchSettings;

/// Every option, each once, as --help shows it.
std::vector<std::string_view> all_options();

/// What --help prints: generated from the rows above and those of the settings.
std::string help_text();
/// What -h prints: one screen.
std::string short_help_text();

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

// SPDX-License-Identifier: MIT
#pragma once

/// `cbcan-sim run`: plays scenarios and reports the results.

#include "app/console.hpp"
#include "cli/run_options.hpp"
#include "text/files.hpp"

namespace cbcan::app {

/// Throws io::EnvironmentError for files that cannot be written, io::UsageError for paths without a scenario.
options::ExitCode run_scenarios(const cli::RunConfig& config, const text::FileReader& read, Console& console);

}  // namespace cbcan::app

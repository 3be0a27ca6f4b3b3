// SPDX-License-Identifier: MIT
#pragma once

/// `cbcan-sim run`: plays scenarios and reports the results.

#include "app/console.hpp"
#include "base/files.hpp"
#include "config/run_options.hpp"

namespace cbcan::app {

/// Throws io::EnvironmentError for files that cannot be written, io::UsageError for paths without a scenario.
base::ExitCode run_scenarios(const config::RunConfig& config, const base::FileReader& read, Console& console);

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

/// `cbcan-sim run`: plays scenarios and says what has come of them.

#include "app/console.hpp"
#include "plant/files.hpp"
#include "plant/run_options.hpp"

namespace cbcan::app {

/// Throws io::EnvironmentError for files that cannot be written, io::UsageError for paths without a scenario.
text::ExitCode run_scenarios(const plant::RunConfig& config, const plant::FileReader& read, Console& console);

}  // namespace cbcan::app

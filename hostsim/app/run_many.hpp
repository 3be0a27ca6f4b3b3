// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "app/console.hpp"
#include "config/build_node.hpp"
#include "config/command_line.hpp"
#include "config/run_options.hpp"
#include "scenario/search/search_settings.hpp"

namespace cbcan::app {

/// Runs at a time: --jobs, or as many as there are processors.
std::size_t at_a_time(const config::SearchConfig& search);

/// Many runs of a command, each with its plant in a process of its own: with each fault at each moment
/// (--explore), or with each seed. Returns the exit code. Throws io::UsageError, io::EnvironmentError.
int run_many(const config::Start& start, const search::Settings& settings, config::EdsFiles& files,
             Console& console);

/// The same for scenarios, in this process.
base::ExitCode explore_scenarios(const std::vector<std::string>& paths, const config::SearchConfig& search,
                                 const base::FileReader& read, Console& console);

/// `cbcan-sim run`: plays scenarios and reports the results. Throws io::EnvironmentError for files that
/// cannot be written, io::UsageError for paths without a scenario.
base::ExitCode run_scenarios(const config::RunConfig& config, const base::FileReader& read, Console& console);

}  // namespace cbcan::app

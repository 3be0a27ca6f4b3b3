// SPDX-License-Identifier: MIT
#pragma once

/// What the options of the command line mean for a configuration.

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "app/config.hpp"

namespace cbcan::app {

/// Every option that is a setting's twin, each once: "--node-id".
std::vector<std::string_view> setting_options();

/// The arguments typed for each of setting_options(), in order; none for one that was not.
using Arguments = std::map<std::string_view, std::vector<std::string>>;

/// True for an option of setting_options() without an argument; it may have =true or =false behind it.
bool is_flag(std::string_view option);

/// True for options that are about a node or a fault and may be given once for each.
bool is_repeatable(std::string_view option);

/// Puts what was typed over what the plant file said. Returns all that is wrong with it; the wrong ones
/// change nothing.
Diagnostics apply_options(const Arguments& arguments, Config& config);

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

/// The options of the command line, and what they mean for a configuration.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/command.hpp"
#include "config/config.hpp"
#include "config/run_options.hpp"

namespace cbcan::config {

inline constexpr std::string_view kConfigOption = "--config";
inline constexpr std::string_view kDemoOption = "--demo";
inline constexpr std::string_view kCheckOption = "--check";
/// The options after it apply to another network.
inline constexpr std::string_view kNetworkOption = "--network";

/// Options that belong to no single setting; their keys begin with their section of --help.
extern const std::span<const base::Row> kOptionRows;

/// Options for many runs of a command.
extern const std::span<const base::Setting<SearchConfig>> kSearchSettings;

/// Every option, each once, as --help shows it.
std::vector<std::string_view> all_options();

struct Argument : base::Argument {
  std::size_t network = 1;  ///< that it applies to; 1 for one of the whole plant, 0 = no number of a network
};
using Arguments = std::vector<Argument>;

/// What --help prints: generated from the rows above and those of the settings.
std::string help_text();
/// What -h prints: one screen.
std::string short_help_text();

/// Applies options to what the plant file has set. Returns all mistakes; a wrong option changes nothing.
Diagnostics apply_options(const Arguments& arguments, Config& config, SearchConfig& search);

}  // namespace cbcan::config

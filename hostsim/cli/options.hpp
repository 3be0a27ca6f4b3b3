// SPDX-License-Identifier: MIT
#pragma once

/// The options of the command line, and what they mean for a configuration.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.hpp"
#include "options/command.hpp"

namespace cbcan::cli {

inline constexpr std::string_view kConfigOption = "--config";
inline constexpr std::string_view kDemoOption = "--demo";
inline constexpr std::string_view kCheckOption = "--check";
/// What stands behind it is about another network.
inline constexpr std::string_view kNetworkOption = "--network";

/// Options that are no single setting's; their keys begin with the section of --help that they stand in.
std::span<const options::Row> option_rows();

/// Every option, each once, as --help shows it.
std::vector<std::string_view> all_options();

/// The network that an argument of kNetworkOption names; 0 = it names none.
std::size_t network_number(std::string_view text);

struct Argument : options::Argument {
  std::size_t network = 1;  ///< that it is about, see network_number(); 1 if it is about the whole plant
};
using Arguments = std::vector<Argument>;

bool is_about_whole_plant(std::string_view option);

bool is_repeatable(std::string_view option);

/// What --help prints: made from the rows above and those of the settings.
std::string help_text();
/// What -h prints: one screen.
std::string short_help_text();

/// Puts what was typed over what the plant file said. Returns all that is wrong with it; the wrong ones
/// change nothing.
config::Diagnostics apply_options(const Arguments& arguments, config::Config& config);

}  // namespace cbcan::cli

// SPDX-License-Identifier: MIT
#pragma once

/// The options of the command line: the twins of the settings, and what they mean for a configuration.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.hpp"
#include "text/setting.hpp"

namespace cbcan::cli {

inline constexpr std::string_view kConfigOption = "--config";
inline constexpr std::string_view kDemoOption = "--demo";
inline constexpr std::string_view kCheckOption = "--check";
inline constexpr std::string_view kHelpOption = "--help";
inline constexpr std::string_view kVersionOption = "--version";
/// What stands behind it is about another network.
inline constexpr std::string_view kNetworkOption = "--network";

/// Options that are no setting's twin; their keys begin with the section of --help that they stand in.
/// Without a key: what is said of an option that makes several settings at once.
std::span<const text::Row> option_rows();

/// "--verbose" and "" of "-v, --verbose", "--node-id" and "N" of "--node-id N".
std::string_view option_name(std::string_view option);
std::string_view option_argument(std::string_view option);

/// Every option, each once, as --help shows it.
std::vector<std::string_view> all_options();

/// What is said of a word that is none of these options.
std::string no_such_option(std::string_view word, std::vector<std::string_view> options);

/// The network that an argument of kNetworkOption names; 0 = it names none.
std::size_t network_number(std::string_view text);

/// An option as it was typed.
struct Argument {
  std::string_view option;  ///< its name
  std::string text;         ///< of a flag: "true", if it has none
  std::size_t network = 1;  ///< that it is about, see network_number(); 1 if it is about the whole plant
};
using Arguments = std::vector<Argument>;

bool is_about_whole_plant(std::string_view option);

/// True for options that are about a node or a fault and may be given once for each.
bool is_repeatable(std::string_view option);

/// What --help prints: made from the rows above and those of the settings.
std::string help_text();

/// Puts what was typed over what the plant file said. Returns all that is wrong with it; the wrong ones
/// change nothing.
config::Diagnostics apply_options(const Arguments& arguments, config::Config& config);

}  // namespace cbcan::cli

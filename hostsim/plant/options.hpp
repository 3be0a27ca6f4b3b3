// SPDX-License-Identifier: MIT
#pragma once

/// The options of the command line: the twins of the settings, and what they mean for a configuration.

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "plant/config.hpp"
#include "text/setting.hpp"

namespace cbcan::plant {

inline constexpr std::string_view kConfigOption = "--config";
inline constexpr std::string_view kDemoOption = "--demo";
/// What stands behind it is about another network.
inline constexpr std::string_view kNetworkOption = "--network";

/// Options that are no setting's twin; their keys begin with the section of --help that they stand in. Without
/// a key: what is said of an option that makes several settings at once.
std::span<const text::Row> option_rows();

/// "--verbose" and "" of "-v, --verbose", "--node-id" and "N" of "--node-id N".
std::string_view option_name(std::string_view option);
std::string_view option_argument(std::string_view option);

/// Every option that is a setting's twin, each once, as --help shows it.
std::vector<std::string_view> setting_options();

/// The network that an argument of kNetworkOption names; 0 = it names none.
std::size_t network_number(std::string_view text);

struct Argument {
  std::string text;
  std::size_t network = 1;  ///< the one that the last kNetworkOption before it names, or it itself
};

/// The arguments typed for each of setting_options(), by their names, and for kNetworkOption, in order.
using Arguments = std::map<std::string_view, std::vector<Argument>>;

/// The network that an argument of this option is about; what is about the whole plant counts as network 1's.
std::size_t network_of(std::string_view option, const Argument& argument);

/// True for options that are about a node or a fault and may be given once for each.
bool is_repeatable(std::string_view option);

/// What --help prints: made from the rows above and those of the settings.
std::string help_text();

/// Puts what was typed over what the plant file said. Returns all that is wrong with it; the wrong ones
/// change nothing.
Diagnostics apply_options(const Arguments& arguments, Config& config);

}  // namespace cbcan::plant

// SPDX-License-Identifier: MIT
#pragma once

/// What the options of the command line mean for a configuration.

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "app/config.hpp"

namespace cbcan::app {

/// Every option that is a setting's twin, each once: "--node-id".
std::vector<std::string_view> setting_options();

/// What stands behind it is about another network.
inline constexpr std::string_view kNetworkOption = "--network";

/// The network that an argument of kNetworkOption names; 0 = it names none.
std::size_t network_number(std::string_view text);

struct Argument {
  std::string text;
  std::size_t network = 1;  ///< the one that the last kNetworkOption before it names, or it itself
};

/// The arguments typed for each of setting_options() and for kNetworkOption, in order; none for one that was
/// not.
using Arguments = std::map<std::string_view, std::vector<Argument>>;

/// True for an option of setting_options() without an argument; it may have =true or =false behind it.
bool is_flag(std::string_view option);

/// The network that an argument of this option is about; what is about the whole plant counts as network 1's.
std::size_t network_of(std::string_view option, const Argument& argument);

/// True for options that are about a node or a fault and may be given once for each.
bool is_repeatable(std::string_view option);

/// Puts what was typed over what the plant file said. Returns all that is wrong with it; the wrong ones
/// change nothing.
Diagnostics apply_options(const Arguments& arguments, Config& config);

}  // namespace cbcan::app

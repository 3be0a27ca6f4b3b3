// SPDX-License-Identifier: MIT
#pragma once

/// Wires of the plant file: parsing of their ends, and checks.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.hpp"
#include "sim/node.hpp"

namespace cbcan::config {

/// "0x6401:2", "0x6200:1.7", "output:8": a number of a node; nullopt if the text is none.
std::optional<sim::Terminal> parse_terminal(std::string_view text);

/// "66:output:8", "2/5:0x2001", "#1:0x2001".
std::optional<WireEnd> parse_wire_end(std::string_view text);

/// The index of the end's node in its network; nullopt if it is not in the plant.
std::optional<std::size_t> place_of(const Config& config, const WireEnd& end);

/// Reports ends at missing nodes, two wires or a wire and a signal at one input, and loops without delay.
void check_wires(const Config& config, Diagnostics& found);

/// Reports ends that their nodes do not have, which only running nodes show. `nodes`: of all networks.
std::vector<std::string> check_wire_ends(const Config& config,
                                         const std::vector<std::vector<sim::NodeParts>>& nodes);

}  // namespace cbcan::config

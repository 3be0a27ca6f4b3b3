// SPDX-License-Identifier: MIT
#pragma once

/// Wires of the plant file: their ends as text, and what is wrong with them.

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "sim/node.hpp"

namespace cbcan::config {

/// "0x6401:2", "0x6200:1.7", "output:8": a number of a node; nullopt where the text is none.
std::optional<sim::Terminal> parse_terminal(std::string_view text);

/// "66:output:8", "2/5:0x2001", "#1:0x2001".
std::optional<WireEnd> parse_wire_end(std::string_view text);

/// The place of the wire's node among those of its network; nullopt where it is not in the plant.
std::optional<std::size_t> place_of(const Config& config, const WireEnd& end);

/// Ends at nodes that there are not, two wires to one input, or a wire and a signal, and wires that go round
/// in a loop without delay.
void check_wires(const Config& config, Diagnostics& found);

/// What only nodes that run can tell: ends that they do not have. `nodes` are all of all networks.
std::vector<std::string> check_wire_ends(const Config& config,
                                         const std::vector<std::vector<sim::NodeParts>>& nodes);

}  // namespace cbcan::config

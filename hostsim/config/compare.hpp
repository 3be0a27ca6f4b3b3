// SPDX-License-Identifier: MIT
#pragma once

/// Compares the nodes of a plant with the network file that its module boots: --check.

#include "config/build_node.hpp"

namespace cbcan::config {

/// Appends a line for each node of a network file that the plant's nodes would not boot as: "network.toml:12:
/// node 66: the plant has no such node". They are warnings, as a test may need such a plant.
void compare_networks(const Config& config, PlantBuild& plant);

}  // namespace cbcan::config

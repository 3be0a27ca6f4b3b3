// SPDX-License-Identifier: MIT
#pragma once

/// Turns a node of the configuration into what the simulation runs: reads its EDS file, applies the values of
/// the plant file, finds its device and prepares its signals.

#include <optional>
#include <string>
#include <vector>

#include "base/files.hpp"
#include "config/config.hpp"
#include "config/eds_file.hpp"
#include "sim/frame_text.hpp"
#include "sim/node.hpp"

namespace cbcan::config {

struct NodeBuild {
  /// The node without parameters and listener; none if a file cannot be read, or a value or signal cannot be
  /// applied.
  std::optional<sim::NodeParts> node;
  std::vector<std::string> problems;  ///< why there is no node
  std::vector<std::string> warnings;  ///< mistakes in the EDS file and what is used instead
};

/// `seed`: see node_seed(); `timing`: of a node without its own. A node without an ID is built for the ID 0,
/// see sim::Node; the node ID in a DCF is ignored. Keeps no reference to `files`.
NodeBuild build_node(const NodeConfig& node, std::uint64_t seed, EdsFiles& files,
                     NodeTiming timing = NodeTiming::kAtOnce);

/// What a module boots, see descriptions::image_of(); empty = nothing.
struct NetworkImage {
  Bytes bytes{};
  std::uint16_t further_first = 0;  ///< see descriptions::PlannedNetwork
};

struct PlantBuild {
  std::vector<std::vector<sim::NodeParts>> networks;  ///< the nodes of each network, in their order
  std::vector<std::vector<sim::TimedFrame>> replays;  ///< of each network, from the start on
  std::vector<NetworkImage> images;                   ///< of each network
  base::FileReader read;                                         ///< reads parameter files
  std::vector<std::string> lines;                                ///< messages, warnings included
  bool good = true;                                              ///< false: nodes are missing
};

/// Builds all nodes of all networks, and reads the frames to be replayed. `files` are kept for further
/// plants.
PlantBuild build_nodes(const Config& config, EdsFiles& files);
/// The same for a single plant.
PlantBuild build_nodes(const Config& config, const base::FileReader& read);

/// "; did you mean 0x6041?", for 6041 without a prefix; empty if that is not in the dictionary either.
std::string meant_index(std::uint16_t index, std::uint8_t sub, const ObjectDictionary& dictionary);

/// The bytes of a value for an object of this type, little-endian; nullopt if it does not fit.
std::optional<Bytes> encode(const Value& value, DataType type);

/// --check: appends a line for each node of a network file that the plant's nodes would not boot as:
/// "network.toml:12: node 66: the plant has no such node". They are warnings, as a test may need such a
/// plant.
void compare_networks(const Config& config, PlantBuild& plant);

}  // namespace cbcan::config

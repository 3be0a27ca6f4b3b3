// SPDX-License-Identifier: MIT
#pragma once

/// From a node of the configuration to what the simulation runs: its EDS read, its values of the plant file
/// put in, its device found, its signals ready.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "config/eds_file.hpp"
#include "config/files.hpp"
#include "sim/frame_text.hpp"
#include "sim/node.hpp"

namespace cbcan::config {

struct NodeBuild {
  /// Without parameters and listener; none if a file cannot be read, or a value or a signal not be put in.
  std::optional<sim::NodeParts> node;
  std::vector<std::string> problems;  ///< why there is no node
  std::vector<std::string> warnings;  ///< what is wrong in the EDS file and what is used in its place
};

/// Builds the nodes of a plant; reads each EDS file once.
class NodeBuilder {
 public:
  explicit NodeBuilder(FileReader read) : read_(std::move(read)) {}

  /// `seed`: see node_seed(). A node without an ID is built for the ID 0, see sim::Node; the node ID that a
  /// DCF has of its own counts for nothing. What is wrong in a file is said with the first of its nodes.
  NodeBuild build(const NodeConfig& node, std::uint64_t seed);

 private:
  FileReader read_;
  std::map<std::string, EdsFile, std::less<>> files_;  ///< by path
};

struct PlantBuild {
  std::vector<std::vector<sim::NodeParts>> networks;  ///< the nodes of each, in their order
  std::vector<std::vector<sim::TimedFrame>> replays;  ///< of each, from the start on
  std::vector<std::string> lines;                     ///< what is to be said, also where nothing is wrong
  bool good = true;                                   ///< false: nodes are missing
};

/// All nodes of all networks, and what is replayed there.
PlantBuild build_nodes(const Config& config, const FileReader& read);

/// The bytes of a value as an object of this type has them, little-endian; nullopt if it does not fit.
std::optional<Bytes> encode(const Value& value, DataType type);

}  // namespace cbcan::config

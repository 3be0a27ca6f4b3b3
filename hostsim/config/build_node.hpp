// SPDX-License-Identifier: MIT
#pragma once

/// From the configuration to what the simulation runs: reads the EDS files of nodes, applies the values of
/// the plant file, finds their devices and prepares their signals and wires.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "base/files.hpp"
#include "config/config.hpp"
#include "descriptions/device_description.hpp"
#include "descriptions/dictionary_image.hpp"
#include "descriptions/eds_reader.hpp"
#include "descriptions/lexer.hpp"
#include "devices/lua/lua_device.hpp"
#include "sim/frame_text.hpp"
#include "sim/node.hpp"

namespace cbcan::config {

/// Nodes differ by the values that contain $NODEID: the file is read once, and the node ID is added to these
/// values. A file with $NODEID elsewhere, such as in a limit, or with a value that fits some IDs only, is
/// read for each node.
class EdsFile {
 public:
  /// `name` is for the diagnostics.
  EdsFile(std::string name, std::string text, devices::ObjectChanges changes = {},
          std::vector<std::string> modules = {});

  struct ForNode {
    descriptions::DictionaryImage image;
    std::vector<descriptions::Diagnostic> diagnostics;
  };
  /// Its content for a node with this ID; 0 = without one.
  ForNode for_node(std::uint8_t node_id) const;

  /// Shared by all nodes that use the file; the values are those without a node ID.
  std::shared_ptr<const descriptions::DeviceDescription> description() const { return description_; }
  /// Objects of modules are its own there.
  const std::string& text() const { return flat_.empty() ? text_ : flat_; }

 private:
  descriptions::Result read(std::uint8_t node_id) const;

  std::string name_;
  std::string text_;
  devices::ObjectChanges changes_;
  std::vector<std::string> modules_;
  std::string flat_;
  bool alike_;    ///< the results for all node IDs, apart from values with $NODEID
  ForNode none_;  ///< if they are alike
  std::shared_ptr<const descriptions::DeviceDescription> description_;
};

/// The path of the node's EDS or DCF file; without one, that of the script that describes it.
std::string description_of(const NodeConfig& node);

/// The EDS and DCF files of any number of plants, each read once.
class EdsFiles {
 public:
  explicit EdsFiles(base::FileReader read) : read_(std::move(read)) {}

  /// Null if it cannot be read. Of a script: the file that its declarations describe; throws
  /// sim::BehaviourProblem. `beside`: path of a script that changes its objects; empty = none. `modules`: see
  /// descriptions::read(), which may throw ModuleError.
  const EdsFile* find(const std::string& path, const std::string& beside = {},
                      const std::vector<base::Line>& modules = {});
  /// Reads all files of a plant.
  const base::FileReader& reader() const { return read_; }

 private:
  base::FileReader read_;
  using Key = std::tuple<std::string, std::string, std::vector<std::string>>;
  std::map<Key, EdsFile> files_;  ///< by path, text of the script, modules
};

/// "0x6401:2", "0x6200:1.7", "output:8": a number of a node; nullopt if the text is none.
std::optional<sim::Terminal> parse_terminal(std::string_view text);

/// The first point of a node with this name, with `-` for blanks; to be read, an output or curve before an
/// input. Otherwise none, and `problem` lists the names.
std::optional<sim::Point> find_point(sim::Node& node, std::string_view name, bool is_read,
                                     std::string& problem);

/// "66:output:8", "2/5:0x2001", "#1:0x2001", "20:level".
std::optional<WireEnd> parse_wire_end(std::string_view text);

/// The index of the end's node in its network; nullopt if it is not in the plant.
std::optional<std::size_t> place_of(const Config& config, const WireEnd& end);

/// Reports ends at missing nodes, two wires or a wire and a signal at one input, and loops without delay.
/// Ends with a name are left out.
void check_wires(const Config& config, std::span<const WireConfig> wires, Diagnostics& found);

/// Finds the names in the ends of `wires`, and reports ends that their nodes do not have, which only running
/// nodes show. `nodes`: of all networks.
std::vector<std::string> connect(const Config& config, const std::vector<std::vector<sim::NodeParts>>& nodes,
                                 std::vector<WireConfig>& wires);

/// Reports each CAN-ID that TPDOs or EMCYs of two nodes of the network have at power-on. `nodes`: all of
/// network.nodes.
void check_can_ids(const NetworkConfig& network, std::vector<sim::NodeParts>& nodes,
                   std::vector<std::string>& lines);

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
  std::vector<WireConfig> wires{};                    ///< of the plant, without names
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

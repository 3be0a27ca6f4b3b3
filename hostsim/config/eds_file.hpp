// SPDX-License-Identifier: MIT
#pragma once

/// One EDS or DCF file for all nodes that use it.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/files.hpp"
#include "config/config.hpp"
#include "descriptions/device_description.hpp"
#include "descriptions/diagnostics.hpp"
#include "descriptions/dictionary_image.hpp"

namespace cbcan::config {

/// Nodes differ by the values that contain $NODEID: the file is read once, and the node ID is added to these
/// values. A file with $NODEID elsewhere, such as in a limit, or with a value that fits some IDs only, is
/// read for each node.
class EdsFile {
 public:
  /// `name` is for the diagnostics.
  EdsFile(std::string name, std::string text);

  struct ForNode {
    descriptions::DictionaryImage image;
    std::vector<descriptions::Diagnostic> diagnostics;
  };
  /// Its content for a node with this ID; 0 = without one.
  ForNode for_node(std::uint8_t node_id) const;

  /// Shared by all nodes that use the file; the values are those without a node ID.
  std::shared_ptr<const descriptions::DeviceDescription> description() const { return description_; }
  const std::string& text() const { return text_; }

 private:
  std::string name_;
  std::string text_;
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
  /// sim::BehaviourProblem.
  const EdsFile* find(const std::string& path);
  /// Reads all files of a plant.
  const base::FileReader& reader() const { return read_; }

 private:
  base::FileReader read_;
  std::map<std::string, EdsFile, std::less<>> files_;  ///< by path
};

}  // namespace cbcan::config

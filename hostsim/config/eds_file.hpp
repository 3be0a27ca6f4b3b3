// SPDX-License-Identifier: MIT
#pragma once

/// One EDS or DCF file for all nodes that use it.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "eds/diagnostics.hpp"
#include "eds/dictionary_image.hpp"
#include "eds/object_names.hpp"

namespace cbcan::config {

/// Nodes differ by the values that contain $NODEID. If the results for the lowest and the highest node ID
/// differ by nothing else, the file is not read again: the node ID is added to these values. Any other file,
/// such as one with $NODEID in a limit or with a value that fits some IDs only, is read for each node.
class EdsFile {
 public:
  /// `name` is for the diagnostics.
  EdsFile(std::string name, std::string text);

  struct ForNode {
    eds::DictionaryImage image;
    std::vector<eds::Diagnostic> diagnostics;  ///< those that all nodes have in common only the first time
  };
  /// For a node with this ID; 0 = without one.
  ForNode for_node(std::uint8_t node_id);

  /// Shared by all nodes that use the file.
  std::shared_ptr<const eds::ObjectNames> names() const { return names_; }

 private:
  std::string name_;
  std::string text_;
  bool alike_;  ///< the results for all node IDs, apart from values with $NODEID
  ForNode none_;
  std::shared_ptr<const eds::ObjectNames> names_;
};

}  // namespace cbcan::config

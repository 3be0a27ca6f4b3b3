// SPDX-License-Identifier: MIT
#pragma once

/// One EDS or DCF file for all nodes that have it.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "eds/diagnostics.hpp"
#include "eds/dictionary_image.hpp"
#include "eds/object_names.hpp"

namespace cbcan::config {

/// Nodes differ in what $NODEID adds to values. A file that says the same with the lowest node ID and with
/// the highest one but for such values is read no more: the values are moved, which takes no parsing. In any
/// other file $NODEID stands in a limit, say, or a value fits with some IDs only; it is read for each node.
class EdsFile {
 public:
  /// `name` is for the diagnostics.
  EdsFile(std::string name, std::string text);

  struct ForNode {
    eds::DictionaryImage image;
    std::vector<eds::Diagnostic> diagnostics;  ///< what all nodes have in common is told the first time only
  };
  /// For a node with this ID; 0 = for none.
  ForNode for_node(std::uint8_t node_id);

  /// For people; shared by all nodes that have the file.
  std::shared_ptr<const eds::ObjectNames> names() const { return names_; }

 private:
  std::string name_;
  std::string text_;
  bool alike_;  ///< for all node IDs
  ForNode none_;
  std::shared_ptr<const eds::ObjectNames> names_;
};

}  // namespace cbcan::config

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

namespace cbcan::plant {

/// Nodes differ in what $NODEID adds to values. A file that says the same with the lowest node ID and with
/// the highest one but for such values is read no more: the values are moved, which takes no parsing. In any
/// other file $NODEID stands in a limit, say, or a value fits with some IDs only; it is read for each node.
class EdsFile {
 public:
  /// `name` is for the diagnostics.
  EdsFile(std::string name, std::string text);

  /// For a node with this ID; 0 = for none.
  eds::DictionaryImage image(std::uint8_t node_id) const;

  /// For people; shared by all nodes that have the file.
  std::shared_ptr<const eds::ObjectNames> names() const { return names_; }

  /// What is wrong in the file; of what all nodes have in common nothing after the first call.
  std::vector<eds::Diagnostic> take_diagnostics(std::uint8_t node_id);

 private:
  std::string name_;
  std::string text_;
  bool alike_;                  ///< for all node IDs
  eds::DictionaryImage image_;  ///< for none
  std::shared_ptr<const eds::ObjectNames> names_;
  std::vector<eds::Diagnostic> diagnostics_;
};

}  // namespace cbcan::plant

// SPDX-License-Identifier: MIT
#pragma once

/// A network file (docs/reference/network-file.md) for nodes that a scan has found, with the EDS files of a
/// folder.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/files.hpp"

namespace cbcan::tools {

struct FoundNode {
  std::uint8_t id = 0;
  std::array<std::uint32_t, 5> identity{};  ///< 1000h, 1018h:01..04; 0 = it has none
  std::string name;                         ///< 1008h
};

/// Each node with the file that describes it, its PDOs and its heartbeat. A node without a file is a comment.
/// `remarks`: files that cannot be used, and what an integrator has to decide; each is in the text, too.
/// Throws UsageError if the folder has no EDS file.
std::string network_text(std::span<const FoundNode> nodes, const std::string& folder,
                         const base::FileReader& read, std::vector<std::string>& remarks);

}  // namespace cbcan::tools

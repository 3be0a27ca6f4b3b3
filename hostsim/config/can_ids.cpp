// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "config/build_node.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::config {

/// "EMCY" or "TPDO 1" for its COB-ID; empty for any other object and a TPDO without a mapping.
static std::string sender(const ObjectDictionary& objects, const ObjectEntry& entry) {
  if (entry.index == object::kEmergencyCobId) return "EMCY";
  const bool is_tpdo = entry.index >= object::kTpdoParameter && entry.index < object::kTpdoMapping;
  if (!is_tpdo || entry.first_sub != descriptions::kCobId) return {};
  if (objects.get(entry.index + descriptions::kToMapping, 0) == 0) return {};
  return fmt::format("TPDO {}", entry.index - object::kTpdoParameter + 1);
}

void check_can_ids(const NetworkConfig& network, std::vector<sim::NodeParts>& nodes,
                   std::vector<std::string>& lines) {
  std::map<std::uint32_t, std::pair<const NodeConfig*, std::string>> senders;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const NodeConfig& node = network.nodes[i];
    const ObjectDictionary objects(nodes[i].image.entries, nodes[i].image.values, nullptr);
    for (const ObjectEntry& entry : objects.entries()) {
      const std::string name = sender(objects, entry);
      if (node.id == 0 || name.empty()) continue;
      const auto cob_id = static_cast<std::uint32_t>(objects.get(entry.index, entry.first_sub));
      if ((cob_id & cob::kInvalid) != 0 || !cob::is_usable(cob_id)) continue;
      const auto& [id, first] = *senders.try_emplace(cob::id_of(cob_id), &node, name).first;
      if (first.first == &node) continue;
      lines.push_back(
          fmt::format("{}: {}: {} ({}) has the CAN-ID {:X}h of {} of node {}; give one of them another",
                      to_string(node.place), node_name(node), name, object_name(entry.index, entry.first_sub),
                      id, first.second, first.first->id));
    }
  }
}

}  // namespace cbcan::config

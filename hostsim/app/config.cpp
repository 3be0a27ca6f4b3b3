// SPDX-License-Identifier: MIT
#include "app/config.hpp"

#include <array>
#include <cstdio>

namespace cbcan::app {
namespace {

std::string object_name(const InitialValue& object) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%04Xh:%02X", object.index, object.sub);
  return text.data();
}

void check_objects(const NodeConfig& node, Diagnostics& found) {
  for (auto later = node.objects.begin(); later != node.objects.end(); ++later) {
    for (auto first = node.objects.begin(); first != later; ++first) {
      if (first->index != later->index || first->sub != later->sub) continue;
      found.push_back({later->place, "node " + std::to_string(node.id) + ": object " + object_name(*later) +
                                         " is already set at " + to_string(first->place) +
                                         "; remove one of the two"});
      break;
    }
  }
}

void check_node_ids(const Config& config, Diagnostics& found) {
  std::array<const NodeConfig*, 128> owner{};
  for (const NodeConfig& node : config.nodes) {
    if (node.id == 0 || node.id >= owner.size()) continue;
    const std::string who = "node " + std::to_string(node.id) + ": ";
    const NodeConfig*& first = owner[node.id];
    if (first != nullptr) {
      found.push_back({node.place, who + "already at " + to_string(first->place) +
                                       "; every node on the bus needs an ID of its own"});
    } else if (config.module.enabled && node.id == config.module.node_id) {
      found.push_back({node.place, who +
                                       "this is the module's own ID; change the node's, or the module's with "
                                       "module.node_id or --node-id"});
    }
    if (first == nullptr) first = &node;
  }
}

}  // namespace

std::string can_spec(const CanConfig& can) {
  return can.kind == CanKind::kVirtual ? "virtual" : "socketcan:" + can.interface_name;
}

Diagnostics check(const Config& config) {
  Diagnostics found;
  check_node_ids(config, found);
  if (config.time.clock == ClockKind::kManual && config.can.kind != CanKind::kVirtual)
    found.push_back(about_option("--clock manual", "the time of " + can_spec(config.can) +
                                                       " cannot stand still; use it with --can virtual"));
  for (const NodeConfig& node : config.nodes)
    check_objects(node, found);
  return found;
}

}  // namespace cbcan::app

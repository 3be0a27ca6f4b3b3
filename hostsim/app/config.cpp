// SPDX-License-Identifier: MIT
#include "app/config.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <string_view>

#include "sim/faults/random.hpp"

namespace cbcan::app {
namespace {

std::string name_of(const InitialValue& value) {
  return "object " + object_name(value.index, value.sub) + " is already set at ";
}

std::string name_of(const SignalConfig& signal) {
  return "object " + object_name(signal.signal.index, signal.signal.sub) + " already has a signal at ";
}

/// Values, or signals, of the same object.
template <class Item>
void check_objects(const NodeConfig& node, const std::vector<Item>& items, Diagnostics& found) {
  for (auto later = items.begin(); later != items.end(); ++later) {
    const auto first =
        std::find_if(items.begin(), later, [&](const Item& item) { return same_object(item, *later); });
    if (first != later)
      found.push_back({later->place, node_name(node) + ": " + name_of(*later) + to_string(first->place) +
                                         "; remove one of the two"});
  }
}

void check_parameter_files(const Config& config, Diagnostics& found) {
  std::map<std::string_view, const NodeConfig*> owners;
  for (const NodeConfig& node : config.nodes) {
    if (node.parameters.empty()) continue;
    const auto [owner, is_first] = owners.emplace(node.parameters, &node);
    if (!is_first)
      found.push_back({node.place, node_name(node) + ": " + node.parameters +
                                       " already has the parameters of " + node_name(*owner->second) +
                                       "; every node needs a file of its own"});
  }
}

void check_node_ids(const Config& config, Diagnostics& found) {
  std::array<const NodeConfig*, 128> owner{};
  for (const NodeConfig& node : config.nodes) {
    if (node.id == 0 || node.id >= owner.size()) continue;
    const std::string who = node_name(node) + ": ";
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

bool same_object(const InitialValue& one, const InitialValue& other) {
  return one.index == other.index && one.sub == other.sub;
}

bool same_object(const SignalConfig& one, const SignalConfig& other) {
  return one.signal.index == other.signal.index && one.signal.sub == other.signal.sub;
}

std::string node_name(const NodeConfig& node) {
  return node.id != 0 ? "node " + std::to_string(node.id) : "node without an ID";
}

std::string object_name(std::uint16_t index, std::uint8_t sub) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%04Xh:%02X", index, sub);
  return text.data();
}

std::uint64_t node_seed(const Config& config, const NodeConfig& node) {
  constexpr std::uint64_t kFirstWithoutId = 128;
  std::uint64_t number = node.id;
  if (number == 0)
    number =
        kFirstWithoutId + static_cast<std::uint64_t>(std::count_if(
                              config.nodes.data(), &node, [](const NodeConfig& n) { return n.id == 0; }));
  return sim::Random(std::uint64_t{config.random.seed} << 32 | number).next();
}

Diagnostics check(const Config& config) {
  Diagnostics found;
  check_node_ids(config, found);
  check_parameter_files(config, found);
  if (config.time.clock == ClockKind::kManual && config.can.kind != CanKind::kVirtual)
    found.push_back(about_option("--clock manual", "the time of " + can_spec(config.can) +
                                                       " cannot stand still; use it with --can virtual"));
  for (const NodeConfig& node : config.nodes) {
    check_objects(node, node.objects, found);
    check_objects(node, node.signals, found);
  }
  return found;
}

}  // namespace cbcan::app

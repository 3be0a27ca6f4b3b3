// SPDX-License-Identifier: MIT
#include "app/config.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "cbcan/regmap.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "io/sockets/stream_listener.hpp"
#include "sim/random.hpp"

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

/// Two names of one file look the same, as far as names can tell.
std::string normal(const std::string& path) {
  return std::filesystem::path(path).lexically_normal().string();
}

void check_parameter_files(const Config& config, Diagnostics& found) {
  std::map<std::string, const NodeConfig*> owners;
  for (const NetworkConfig& network : config.networks) {
    for (const NodeConfig& node : network.nodes) {
      if (node.parameters.empty()) continue;
      const auto [owner, is_first] = owners.emplace(normal(node.parameters), &node);
      if (!is_first)
        found.push_back({node.place, node_name(node) + ": " + node.parameters +
                                         " already has the parameters of " + node_name(*owner->second) +
                                         " at " + to_string(owner->second->place) +
                                         "; every node needs a file of its own"});
    }
  }
}

/// What no two networks can have: the key of its setting, and it.
std::vector<std::pair<std::string_view, std::string>> belongings(const NetworkConfig& network) {
  std::vector<std::pair<std::string_view, std::string>> all;
  if (network.can.kind == CanKind::kSocketCan) all.emplace_back("can.spec", can_spec(network.can));
  if (!network.log.file.empty()) all.emplace_back("log.file", normal(network.log.file));
  if (network.can.slcan.empty()) return all;
  io::StreamAddress address = io::parse_stream_address(network.can.slcan);
  const bool any_free_port = address.path.empty() && address.tcp.port == 0;
  if (!address.path.empty()) address.path = normal(address.path);
  if (!any_free_port) all.emplace_back("can.slcan", io::to_string(address));
  return all;
}

void check_belongings(const Config& config, Diagnostics& found) {
  std::map<std::pair<std::string_view, std::string>, const NetworkConfig*> owners;
  for (const NetworkConfig& network : config.networks) {
    for (const auto& [key, what] : belongings(network)) {
      const auto [owner, is_first] = owners.emplace(std::pair(key, what), &network);
      if (is_first) continue;
      const NetworkConfig& first = *owner->second;
      found.push_back({network.places.at(key), in_network(network.number) + std::string(key) + " " + what +
                                                   ": network " + std::to_string(first.number) +
                                                   " has it already at " + to_string(first.places.at(key)) +
                                                   "; every network needs its own"});
    }
  }
}

void check_number_of_networks(const Config& config, Diagnostics& found) {
  constexpr std::size_t kMost = io::ModbusTcp::kMostNetworks;
  if (config.networks.size() > kMost)
    found.push_back({config.networks[kMost].place, "network " + std::to_string(kMost + 1) +
                                                       ": there can be " + std::to_string(kMost) +
                                                       " at most, as many as Modbus has unit IDs"});
}

void check_node_ids(const NetworkConfig& network, Diagnostics& found) {
  std::array<const NodeConfig*, 128> owner{};
  for (const NodeConfig& node : network.nodes) {
    if (node.id == 0 || node.id >= owner.size()) continue;
    const std::string who = node_name(node) + ": ";
    const NodeConfig*& first = owner[node.id];
    if (first != nullptr) {
      found.push_back({node.place, who + "already at " + to_string(first->place) +
                                       "; every node on the bus needs an ID of its own"});
    } else if (network.module.enabled && node.id == network.module.node_id) {
      found.push_back({node.place, who +
                                       "this is the module's own ID; change the node's, or the module's with "
                                       "module.node_id or --node-id"});
    }
    if (first == nullptr) first = &node;
  }
}

/// Of the member of a network with this number.
std::uint64_t seed_of(const Config& config, std::size_t network, std::uint64_t number) {
  return sim::Random(std::uint64_t{config.random.seed} << 32 | std::uint64_t{network - 1} << 24 | number)
      .next();
}

/// A range of the module's registers, and the key of the setting that says where it begins.
struct Registers {
  std::string_view key;
  std::size_t first;
  std::size_t words;
  std::size_t end() const { return first + words; }
};

std::string to_string(const Registers& range) {
  const std::string name = range.key.empty() ? "" : " of " + std::string(range.key);
  return "R" + std::to_string(range.first) + "..R" + std::to_string(range.end() - 1) + name;
}

void check_registers(const NetworkConfig& network, Diagnostics& found) {
  const ModuleConfig& module = network.module;
  const std::array<Registers, 4> ranges{{
      {"", regmap::kWindowFirst, regmap::kWindowWords},
      {"module.process_first", module.process_first, regmap::kProcessWords},
      {"module.scanner_out_first", module.scanner_out_first, regmap::kScannerOutWords},
      {"module.scanner_in_first", module.scanner_in_first, regmap::kScannerInWords},
  }};
  for (std::size_t later = 1; later < ranges.size(); ++later) {
    for (std::size_t first = 0; first < later; ++first) {
      const Registers& one = ranges[first];
      const Registers& other = ranges[later];
      if (one.first >= other.end() || other.first >= one.end()) continue;
      const std::string_view key = network.places.contains(other.key) ? other.key : one.key;
      found.push_back({network.places.at(key), in_network(network.number) + to_string(other) +
                                                   " would lie over " + to_string(one) +
                                                   "; every range needs registers of its own"});
    }
  }
}

void check_network(const Config& config, const NetworkConfig& network, Diagnostics& found) {
  check_node_ids(network, found);
  check_registers(network, found);
  if (config.time.clock == ClockKind::kManual && network.can.kind != CanKind::kVirtual)
    found.push_back(about_option("--clock manual", in_network(network.number) + "the time of " +
                                                       can_spec(network.can) +
                                                       " cannot stand still; use it with --can virtual"));
  for (const NodeConfig& node : network.nodes) {
    check_objects(node, node.objects, found);
    check_objects(node, node.signals, found);
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

std::string in_network(std::size_t number) {
  return number == 1 ? "" : "network " + std::to_string(number) + ": ";
}

std::string node_name(const NodeConfig& node) {
  return in_network(node.network) + (node.id != 0 ? "node " + std::to_string(node.id) : "node without an ID");
}

std::string object_name(std::uint16_t index, std::uint8_t sub) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%04Xh:%02X", index, sub);
  return text.data();
}

std::uint64_t network_seed(const Config& config, const NetworkConfig& network) {
  constexpr std::uint64_t kItself = 0;  // no node has it
  return network.number == 1 ? config.random.seed : seed_of(config, network.number, kItself);
}

std::uint64_t node_seed(const Config& config, const NodeConfig& node) {
  constexpr std::uint64_t kFirstWithoutId = 128;
  std::uint64_t number = node.id;
  if (number == 0)
    number = kFirstWithoutId +
             static_cast<std::uint64_t>(std::count_if(config.networks[node.network - 1].nodes.data(), &node,
                                                      [](const NodeConfig& n) { return n.id == 0; }));
  return seed_of(config, node.network, number);
}

Diagnostics check(const Config& config) {
  Diagnostics found;
  for (const NetworkConfig& network : config.networks)
    check_network(config, network, found);
  check_number_of_networks(config, found);
  check_parameter_files(config, found);
  check_belongings(config, found);
  return found;
}

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#include "config/config.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "cbcan/regmap.hpp"
#include "config/can_spec.hpp"
#include "config/wires.hpp"
#include "sim/random.hpp"
#include "text/address.hpp"

namespace cbcan::config {
namespace {

std::string name_of(const InitialValue& value) {
  return fmt::format("object {} is already set", object_name(value.index, value.sub));
}

std::string name_of(const SignalConfig& signal) {
  return fmt::format("object {} already has a signal", object_name(signal.signal.index, signal.signal.sub));
}

/// Values, or signals, of the same object.
template <class Item>
void check_objects(const NodeConfig& node, const std::vector<Item>& items, Diagnostics& found) {
  for (auto later = items.begin(); later != items.end(); ++later) {
    const auto first =
        std::find_if(items.begin(), later, [&](const Item& item) { return same_object(item, *later); });
    if (first != later)
      found.push_back({later->place, fmt::format("{}: {} at {}; remove one of the two", node_name(node),
                                                 name_of(*later), to_string(first->place))});
  }
}

/// Two names of one file look the same, as far as names can tell.
std::string normal(const std::string& path) {
  return std::filesystem::path(path).lexically_normal().string();
}

void check_parameter_files(const Config& config, Diagnostics& found) {
  std::map<std::string, std::pair<std::string, Place>> owners;
  const auto own = [&](const std::string& file, const std::string& name, const Place& place) {
    const auto [owner, is_first] = owners.emplace(normal(file), std::pair(name, place));
    if (is_first) return;
    found.push_back(
        {place,
         fmt::format("{}: {} already has the parameters of {} at {}; every node needs a file of its own",
                     name, file, owner->second.first, to_string(owner->second.second))});
  };
  for (const NetworkConfig& network : config.networks) {
    if (const std::string& file = network.module.parameters; !file.empty())
      own(file, in_network(network.number) + "module", network.places.at("module.parameters"));
    for (const NodeConfig& node : network.nodes)
      if (!node.parameters.empty()) own(node.parameters, node_name(node), node.place);
  }
}

/// What no two networks can have: the key of its setting, and it.
std::vector<std::pair<std::string_view, std::string>> belongings(const NetworkConfig& network) {
  std::vector<std::pair<std::string_view, std::string>> all;
  if (!network.can.outside.empty()) all.emplace_back("can.spec", network.can.outside);
  if (!network.plc.line.device.empty()) all.emplace_back("plc.device", normal(network.plc.line.device));
  if (!network.log.empty()) all.emplace_back("log.file", normal(network.log));
  for (const auto& [key, where] :
       {std::pair("can.slcan", &network.can.slcan), std::pair("can.socketcand", &network.can.socketcand)}) {
    if (where->empty()) continue;
    text::StreamAddress address = text::parse_stream_address(*where);
    const bool any_free_port = address.path.empty() && address.tcp.port == 0;
    if (!address.path.empty()) address.path = normal(address.path);
    if (!any_free_port) all.emplace_back(key, text::to_string(address));
  }
  return all;
}

void check_belongings(const Config& config, Diagnostics& found) {
  std::map<std::pair<std::string_view, std::string>, const NetworkConfig*> owners;
  for (const NetworkConfig& network : config.networks) {
    for (const auto& [key, what] : belongings(network)) {
      const auto [owner, is_first] = owners.emplace(std::pair(key, what), &network);
      if (is_first) continue;
      const NetworkConfig& first = *owner->second;
      found.push_back({network.places.at(key),
                       fmt::format("{}{} {}: network {} has it already at {}; every network needs its own",
                                   in_network(network.number), key, what, first.number,
                                   to_string(first.places.at(key)))});
    }
  }
}

/// Addresses and serial ports that the program opens, by the keys of their settings: no two can be the same.
class Doors {
 public:
  explicit Doors(Diagnostics& found) : found_(found) {}

  void listen(std::string_view key, std::size_t network, const std::string& address) {
    if (address.empty()) return;
    text::StreamAddress parsed = text::parse_stream_address(address);
    if (parsed.path.empty() && parsed.tcp.port == 0) return;
    if (!parsed.path.empty()) parsed.path = normal(parsed.path);
    own(key, network, text::to_string(parsed));
  }
  void open(std::string_view key, std::size_t network, const std::string& device) {
    if (!device.empty()) own(key, network, normal(device));
  }

 private:
  void own(std::string_view key, std::size_t network, const std::string& what) {
    const auto [owner, is_first] = owners_.emplace(what, key);
    if (is_first || owner->second == key) return;  // of two networks check_belongings() tells
    found_.push_back(about_option(fmt::format("{}{} {}", in_network(network), key, what),
                                  fmt::format("{} has it already; write another one", owner->second)));
  }

  Diagnostics& found_;
  std::map<std::string, std::string_view> owners_;
};

void check_doors(const Config& config, Diagnostics& found) {
  Doors doors(found);
  const auto serves = [](const NetworkConfig& network) { return network.module.enabled; };
  if (std::ranges::any_of(config.networks, serves)) {
    doors.listen("modbus.port", 1, text::to_string(config.modbus));
    doors.listen("rtu.listen", 1, config.rtu.listen);
    doors.open("rtu.device", 1, config.rtu.line.device);
  }
  doors.listen("control.listen", 1, config.control);
  doors.listen("http.listen", 1, config.http.listen);
  for (const NetworkConfig& network : config.networks) {
    doors.listen("can.slcan", network.number, network.can.slcan);
    doors.listen("can.socketcand", network.number, network.can.socketcand);
    if (network.can.outside.starts_with("slcan:"))
      doors.open("can.spec", network.number, parse_can_spec(network.can.outside).name);
    if (network.module.enabled) doors.open("plc.device", network.number, network.plc.line.device);
  }
}

void check_number_of_networks(const Config& config, Diagnostics& found) {
  if (config.networks.size() > kMostNetworks)
    found.push_back({config.networks[kMostNetworks].place,
                     fmt::format("network {}: there can be {} at most, as many as Modbus has unit IDs",
                                 kMostNetworks + 1, kMostNetworks)});
}

void check_node_ids(const NetworkConfig& network, Diagnostics& found) {
  std::array<const NodeConfig*, 128> owner{};
  for (const NodeConfig& node : network.nodes) {
    if (node.id == 0 || node.id >= owner.size()) continue;
    const NodeConfig*& first = owner[node.id];
    if (first != nullptr) {
      found.push_back(
          {node.place, fmt::format("{}: already at {}; every node on the bus needs an ID of its own",
                                   node_name(node), to_string(first->place))});
    } else if (network.module.enabled && node.id == network.module.node_id) {
      found.push_back({node.place, node_name(node) +
                                       ": this is the module's own ID; change the node's, or the module's "
                                       "with module.node_id"});
    }
    if (first == nullptr) first = &node;
  }
}

/// Of the member of a network with this number.
std::uint64_t seed_of(const Config& config, std::size_t network, std::uint64_t number) {
  return sim::Random(std::uint64_t{config.seed} << 32 | std::uint64_t{network - 1} << 24 | number).next();
}

/// A range of the module's registers, and the key of the setting that says where it begins.
struct Registers {
  std::string_view key;
  std::size_t first;
  std::size_t words;
  std::size_t channel = 1;
  std::size_t end() const { return first + words; }
  bool overlaps(const Registers& other) const { return first < other.end() && other.first < end(); }
};

std::string to_string(const Registers& range) {
  const std::string name = range.key.empty() ? "" : " of " + std::string(range.key);
  const std::string channel = range.channel == 1 ? "" : fmt::format(", channel {}", range.channel);
  return fmt::format("R{}..R{}{}{}", range.first, range.end() - 1, name, channel);
}

std::vector<Registers> registers_of(const ModuleConfig& module) {
  std::vector<Registers> ranges{{"", regmap::kWindowFirst, regmap::kWindowWords},
                                {"module.process_first", module.process_first, regmap::kProcessWords}};
  for (std::size_t n = 1; n <= module.channels; ++n) {
    const std::size_t behind = regmap::kScannerStride * (n - 1);
    ranges.push_back(
        {"module.scanner_out_first", module.scanner_out_first + behind, regmap::kScannerOutWords, n});
    ranges.push_back(
        {"module.scanner_in_first", module.scanner_in_first + behind, regmap::kScannerInWords, n});
  }
  return ranges;
}

/// One complaint is enough: channels lie one behind the other.
void check_registers(const NetworkConfig& network, Diagnostics& found) {
  const std::vector<Registers> ranges = registers_of(network.module);
  const auto complain = [&](const Registers& range, const Registers& other, const std::string& what) {
    const std::string_view key = network.places.contains(range.key) ? range.key : other.key;
    const std::string_view way_out =
        range.channel == 1 ? "" : ", or fewer channels do: module.channels";
    found.push_back({network.places.at(key),
                     fmt::format("{}{} {}{}", in_network(network.number), to_string(range), what, way_out)});
  };
  for (std::size_t later = 1; later < ranges.size(); ++later) {
    const Registers& range = ranges[later];
    if (range.end() > regmap::kRegisterFileWords)
      return complain(range, range, "would be after R4167, the last register");
    for (std::size_t first = 0; first < later; ++first)
      if (range.overlaps(ranges[first]))
        return complain(
            range, ranges[first],
            "would lie over " + to_string(ranges[first]) + "; every range needs registers of its own");
  }
}

void check_plc(const NetworkConfig& network, Diagnostics& found) {
  if (!network.plc.address.empty() && !network.plc.line.device.empty())
    found.push_back({network.places.at("plc.device"),
                     in_network(network.number) + "plc.device: the PLC is at " + network.plc.address +
                         " already; leave out one of plc.address (--plc) and plc.device"});
}

void check_network(const Config& config, const NetworkConfig& network, Diagnostics& found) {
  check_node_ids(network, found);
  check_registers(network, found);
  check_plc(network, found);
  if (config.clock == ClockKind::kManual && !network.can.outside.empty())
    found.push_back(about_option("--clock manual",
                                 fmt::format("{}the time of {} cannot stand still; use it with --can virtual",
                                             in_network(network.number), can_spec(network.can))));
  for (const NodeConfig& node : network.nodes) {
    check_objects(node, node.objects, found);
    check_objects(node, node.signals, found);
  }
}

}  // namespace

bool logs_to_standard_output(const Config& config) {
  return config.pcap == kStandardOutput || std::ranges::any_of(config.networks, [](const auto& network) {
           return network.log == kStandardOutput;
         });
}

std::string can_spec(const CanConfig& can) {
  return can.outside.empty() ? "virtual" : can.outside;
}

bool same_object(const InitialValue& one, const InitialValue& other) {
  return one.index == other.index && one.sub == other.sub;
}

bool same_object(const SignalConfig& one, const SignalConfig& other) {
  return one.signal.index == other.signal.index && one.signal.sub == other.signal.sub;
}

std::string in_network(std::size_t number) {
  return number == 1 ? "" : fmt::format("network {}: ", number);
}

std::string node_name(const NodeConfig& node) {
  return in_network(node.network) + (node.id != 0 ? fmt::format("node {}", node.id) : "node without an ID");
}

std::string object_name(std::uint16_t index, std::uint8_t sub) {
  return fmt::format("{:04X}h:{:02X}", index, sub);
}

std::uint64_t network_seed(const Config& config, const NetworkConfig& network) {
  constexpr std::uint64_t kItself = 0;  // no node has it
  return network.number == 1 ? config.seed : seed_of(config, network.number, kItself);
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
  if (config.clock == ClockKind::kManual && logs_to_standard_output(config))
    found.push_back(about_option(config.pcap == kStandardOutput ? "--pcap -" : "--log -",
                                 "standard output has the responses of --clock manual; name a file"));
  check_parameter_files(config, found);
  check_belongings(config, found);
  check_doors(config, found);
  check_wires(config, found);
  return found;
}

}  // namespace cbcan::config

// SPDX-License-Identifier: MIT
#include "config/config.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/text.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/slcan/slcan.hpp"
#include "config/build_node.hpp"
#include "sim/random.hpp"

namespace cbcan::config {

namespace {

/// Linux: IFNAMSIZ is 16 with the terminating zero.
constexpr std::size_t kLongestInterfaceName = 15;
constexpr std::size_t kLongestBusName = 16;
constexpr std::uint32_t kBitsPerKbit = 1000;

constexpr std::array<std::string_view, 4> kKinds{"socketcan", "slcan", "socketcand", "virtual"};
/// Examples in messages about missing parts.
constexpr std::array<std::string_view, 3> kExamples{"socketcan:vcan0", "slcan:/dev/ttyACM0",
                                                    "socketcand:127.0.0.1:29536/can0"};

[[noreturn]] void refuse(const std::string& why) {
  throw base::UsageError(why);
}

bool looks_like_interface(std::string_view text) {
  return text.starts_with("can") || text.starts_with("vcan") || text.starts_with("slcan");
}

/// `spec` is `kind`, or begins with `kind` and ":".
[[noreturn]] void refuse_kind(std::string_view spec, std::string_view kind) {
  const std::string_view meant = base::nearest(kind, kKinds);
  if (meant == kKinds.back()) refuse("no such bus; did you mean virtual?");
  if (looks_like_interface(spec)) refuse(fmt::format("no such bus; did you mean socketcan:{}?", spec));
  if (meant.empty()) refuse("no such bus; write virtual or socketcan:vcan0");
  const auto place = static_cast<std::size_t>(std::ranges::find(kKinds, meant) - kKinds.begin());
  const std::string tail(spec == kind ? kExamples[place].substr(meant.size()) : spec.substr(kind.size()));
  refuse(fmt::format("no such bus; did you mean {}{}?", meant, tail));
}

std::string interface_of(std::string_view name) {
  if (name.empty()) refuse("the interface is missing; write socketcan:vcan0");
  if (name.size() > kLongestInterfaceName) refuse("interface names have at most 15 characters");
  if (name.find_first_of(" \t/:") != std::string_view::npos)
    refuse("interface names have no blank, slash or colon; write socketcan:vcan0");
  return std::string(name);
}

base::ListenAddress remote_of(std::string_view text, std::string_view example) {
  base::ListenAddress address;
  if (!text.empty()) address = base::parse_listen_address(text, 0);
  if (address.port == 0) refuse(fmt::format("the address is missing, or its port; write {}", example));
  return address;
}

std::uint16_t kbit_of(std::string_view text) {
  const auto rate = base::parse<std::uint32_t>(text);
  if (rate && *rate % kBitsPerKbit == 0 &&
      std::ranges::find(slcan::kBitRates, *rate / kBitsPerKbit) != slcan::kBitRates.end())
    return static_cast<std::uint16_t>(*rate / kBitsPerKbit);
  refuse(fmt::format(
      "\"{}\" is no bit rate of an adapter; those are 10000, 20000, 50000, 100000, 125000, 250000, "
      "500000, 800000 and 1000000",
      text));
}

CanSpec adapter_of(std::string_view text) {
  CanSpec spec{.kind = CanSpec::Kind::kSlcan, .name = {}, .remote = {}};
  if (const std::size_t at = text.rfind('@'); at != std::string_view::npos) {
    spec.kbit = kbit_of(text.substr(at + 1));
    text = text.substr(0, at);
  }
  if (base::is_absolute(text))
    spec.name = text;
  else
    spec.remote = remote_of(text, "slcan:/dev/ttyACM0 or slcan:HOST:PORT");
  return spec;
}

CanSpec socketcand_of(std::string_view text) {
  const auto [address, bus] = base::split(text, '/').value_or(std::pair(text, std::string_view()));
  if (bus.empty() || bus.size() > kLongestBusName || bus.find_first_of(" \t<>") != std::string_view::npos)
    refuse("the remote bus is missing, has a blank or more than 16 characters; write " +
           std::string(kExamples[2]));
  return {CanSpec::Kind::kSocketcand, std::string(bus), remote_of(address, kExamples[2])};
}

/// Reports two values, or two signals, of one object.
template <class Item>
void check_objects(const NodeConfig& node, const std::vector<Item>& items, std::string_view what,
                   Diagnostics& found) {
  for (auto later = items.begin(); later != items.end(); ++later) {
    const auto [index, sub] = object_of(*later);
    const auto first =
        std::ranges::find(items, object_of(*later), [](const Item& item) { return object_of(item); });
    if (first != later)
      found.push_back({later->place, fmt::format("{}: object {} {} at {}; remove one of the two", node_name(node),
                                                 object_name(index, sub), what, to_string(first->place))});
  }
}

/// Two names of one file become equal, as far as the names show it.
std::string normal(const std::string& path) {
  return base::path_in({}, path);
}

/// Files, addresses, serial ports and buses, each of which only one setting can have.
class Owners {
 public:
  explicit Owners(Diagnostics& found) : found_(found) {}

  /// `name`: of the setting. `place`: empty for a setting of the whole plant.
  void own(std::string_view what, const std::string& name, const Place& place = {}) {
    if (what.empty()) return;
    const auto [owner, is_first] = owners_.emplace(what, std::pair(name, place));
    if (is_first) return;
    const auto& [other, where] = owner->second;
    const std::string at = where.source.empty() ? "" : " at " + to_string(where);
    const std::string message = fmt::format("{} has it already{}; write another one", other, at);
    const std::string setting = fmt::format("{} {}", name, what);
    found_.push_back(place.source.empty() ? about_option(setting, message)
                                          : Diagnostic{place, setting + ": " + message});
  }
  void own_file(const std::string& path, const std::string& name, const Place& place = {}) {
    own(normal(path), name, place);
  }
  void own_address(const std::string& text, const std::string& name, const Place& place = {}) {
    if (text.empty()) return;
    base::StreamAddress address = base::parse_stream_address(text);
    const bool any_free_port = address.path.empty() && address.tcp.port == 0;
    if (!address.path.empty()) address.path = normal(address.path);
    if (!any_free_port) own(base::to_string(address), name, place);
  }

 private:
  Diagnostics& found_;
  std::map<std::string, std::pair<std::string, Place>, std::less<>> owners_;
};

void own_those_of(const NetworkConfig& network, Owners& owners) {
  const auto each = [&](auto own, std::string_view key, const std::string& what) {
    const auto place = network.places.find(key);
    (owners.*own)(what, fmt::format("{}{}", in_network(network.number), key),
                  place == network.places.end() ? Place() : place->second);
  };
  const std::string& bus = network.can.outside;
  const std::string line = bus.starts_with("slcan:") ? parse_can_spec(bus).name : "";
  each(&Owners::own_file, "can.spec", line.empty() ? bus : line);
  each(&Owners::own_file, "log.file", network.log);
  each(&Owners::own_address, "can.slcan", network.can.slcan);
  each(&Owners::own_address, "can.socketcand", network.can.socketcand);
  each(&Owners::own_file, "module.parameters", network.module.parameters);
  if (network.module.enabled) each(&Owners::own_file, "plc.device", network.plc.line.device);
  for (const NodeConfig& node : network.nodes)
    owners.own_file(node.parameters, node_name(node) + ": node.parameters", node.place);
}

void check_owners(const Config& config, Diagnostics& found) {
  Owners owners(found);
  const auto serves = [](const NetworkConfig& network) { return network.module.enabled; };
  if (std::ranges::any_of(config.networks, serves)) {
    owners.own_address(base::to_string(config.modbus), "modbus.port");
    owners.own_address(config.rtu.listen, "rtu.listen");
    owners.own_file(config.rtu.line.device, "rtu.device");
  }
  owners.own_address(config.control, "control.listen");
  owners.own_address(config.http.listen, "http.listen");
  for (const NetworkConfig& network : config.networks)
    own_those_of(network, owners);
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

/// Seed of the member with this number in a network.
std::uint64_t seed_of(const Config& config, std::size_t network, std::uint64_t number) {
  return sim::Random(std::uint64_t{config.seed} << 32 | std::uint64_t{network - 1} << 24 | number).next();
}

/// A range of the module's registers, and the key of the setting for its first register.
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
                                {"", regmap::kNodeRequest, 2},
                                {"module.process_first", module.process_first, regmap::kProcessWords},
                                {"module.status_first", module.status_first, regmap::kStatusWords}};
  for (unsigned n = 1; n <= module.channels; ++n) {
    ranges.push_back({"module.scanner_out_first", regmap::of_channel(module.scanner_out_first, n),
                      regmap::kScannerOutWords, n});
    ranges.push_back({"module.scanner_in_first", regmap::of_channel(module.scanner_in_first, n),
                      regmap::kScannerInWords, n});
  }
  return ranges;
}

/// Reports only the first: if one channel has no room, those after it have none either.
void check_registers(const NetworkConfig& network, Diagnostics& found) {
  const std::vector<Registers> ranges = registers_of(network.module);
  const auto complain = [&](const Registers& range, const Registers& other, const std::string& what) {
    const std::string_view key = network.places.contains(range.key) ? range.key : other.key;
    const std::string_view way_out = range.channel == 1 ? "" : ", or fewer channels do: module.channels";
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
    check_objects(node, node.objects, "is already set", found);
    check_objects(node, node.signals, "already has a signal", found);
  }
}

}  // namespace

Diagnostic about_option(std::string_view typed, std::string message) {
  return {{std::string(typed), 0}, std::move(message)};
}

std::string to_string(const Place& place) {
  return place.line == 0 ? place.source : place.source + ":" + std::to_string(place.line);
}

std::string to_string(const Diagnostic& diagnostic) {
  return base::to_utf8(to_string(diagnostic.place) + ": " + diagnostic.message);
}

void sort_by_place(Diagnostics& diagnostics) {
  std::ranges::stable_sort(diagnostics, {}, [](const Diagnostic& diagnostic) {
    return std::pair(diagnostic.place.line == 0, diagnostic.place.line);
  });
}

CanSpec parse_can_spec(std::string_view spec) {
  const auto [kind, rest] = base::split(spec, ':').value_or(std::pair(spec, std::string_view()));
  if (kind == kKinds[0]) return {CanSpec::Kind::kSocketCan, interface_of(rest), {}};
  if (kind == kKinds[1]) return adapter_of(rest);
  if (kind == kKinds[2]) return socketcand_of(rest);
  if (kind == kKinds.back()) refuse("the virtual bus has no interface; write virtual");
  refuse_kind(spec, kind);
}

bool logs_to_standard_output(const Config& config) {
  return config.pcap == kStandardOutput || std::ranges::any_of(config.networks, [](const auto& network) {
           return network.log == kStandardOutput;
         });
}

std::string can_spec(const CanConfig& can) {
  return can.outside.empty() ? "virtual" : can.outside;
}

std::string in_network(std::size_t number) {
  return number == 1 ? "" : fmt::format("network {}: ", number);
}

std::string node_name(const NodeConfig& node) {
  return in_network(node.network) + (node.id != 0 ? fmt::format("node {}", node.id) : "node without an ID");
}

NodeConfig* find_node(NetworkConfig& network, std::string_view id) {
  constexpr std::int64_t kNobody = -1;
  const auto node =
      std::ranges::find(network.nodes, base::parse_integer(id).value_or(kNobody), &NodeConfig::id);
  return node == network.nodes.end() ? nullptr : &*node;
}

std::optional<FaultList> faults_at(NetworkConfig& network, std::string_view place) {
  if (place == "bus") return FaultList{&network.can.faults, sim::FaultPlace::kBus};
  if (place == "plc") return FaultList{&network.plc.faults, sim::FaultPlace::kPlc};
  NodeConfig* const node = find_node(network, place);
  if (node == nullptr) return std::nullopt;
  return FaultList{&node->faults, sim::FaultPlace::kNode};
}

std::string object_name(std::uint16_t index, std::uint8_t sub) {
  return fmt::format("{:04X}h:{:02X}", index, sub);
}

std::uint64_t network_seed(const Config& config, const NetworkConfig& network) {
  constexpr std::uint64_t kItself = 0;  // no node has this number
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
  if (config.networks.size() > kMostNetworks)
    found.push_back({config.networks[kMostNetworks].place,
                     fmt::format("network {}: there can be {} at most, as many as Modbus has unit IDs",
                                 kMostNetworks + 1, kMostNetworks)});
  if (config.clock == ClockKind::kManual && logs_to_standard_output(config))
    found.push_back(about_option(config.pcap == kStandardOutput ? "--pcap -" : "--log -",
                                 "standard output has the responses of --clock manual; name a file"));
  check_owners(config, found);
  check_wires(config, config.wires, found);
  return found;
}

std::string problem_of_further(const NetworkConfig& network, std::uint16_t first) {
  const Registers further{"network.further_first", first, 2 * regmap::kFurtherWords};
  if (first != 0 && !(network.plc.address.empty() && network.plc.line.device.empty()))
    return "network.further_first: a PLC that owns the registers has none of these; leave it out";
  for (const Registers& range : registers_of(network.module))
    if (first != 0 && further.overlaps(range))
      return fmt::format("{} would lie over {}; choose other ones", to_string(further), to_string(range));
  return {};
}

}  // namespace cbcan::config

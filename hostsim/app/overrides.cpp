// SPDX-License-Identifier: MIT
#include "app/overrides.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <set>
#include <sstream>
#include <utility>

#include "app/settings.hpp"
#include "app/suggest.hpp"
#include "io/errors.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "io/sockets/listen_address.hpp"

namespace cbcan::app {
namespace {

constexpr std::string_view kModbus = "--modbus";
constexpr std::string_view kNode = "--node";
constexpr std::string_view kHeartbeat = "--heartbeat";
constexpr std::string_view kObject = "--object";
constexpr std::string_view kSignal = "--signal";
constexpr std::string_view kFault = "--fault";
constexpr std::string_view kOpposite = "--no-";

/// The parts left and right of the first `mark`; one part where there is none.
std::vector<std::string> split(const std::string& text, char mark) {
  const auto at = text.find(mark);
  if (at == std::string::npos) return {text};
  return {text.substr(0, at), text.substr(at + 1)};
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

/// An example of a plant file in the words of an option: "to=100"
std::string as_word(std::string_view example) {
  std::string word(example);
  std::erase_if(word, [](char letter) { return letter == ' ' || letter == '"'; });
  return word;
}

/// What the plant file set gives way; what another option set stays, so that check() complains about the two.
template <class Item>
void put_item(std::vector<Item>& items, Item item) {
  std::erase_if(items,
                [&item](const Item& other) { return same_object(other, item) && other.place.line != 0; });
  items.push_back(std::move(item));
}

template <class Target>
bool has_option(std::span<const Setting<Target>> rows, std::string_view option) {
  return std::ranges::any_of(rows, [option](const auto& row) { return option_name(row.option) == option; });
}

class Overrides {
 public:
  Overrides(const Arguments& arguments, Config& config) : arguments_(arguments), config_(config) {}

  Diagnostics apply() {
    make_networks();
    for (const auto& row : network_settings())
      each(option_name(row.option), [&](const std::string& text, const Place& where) {
        if (apply_setting(row, *network_, text, where)) network_->places[row.key] = where;
      });
    for (const auto& row : settings()) {
      const std::string_view option = option_name(row.option);
      if (option == kModbus) continue;
      each(option,
           [&](const std::string& text, const Place& where) { apply_setting(row, config_, text, where); });
    }
    each(kModbus, &Overrides::apply_modbus);
    each(kNode, &Overrides::apply_node);
    for (const auto& row : node_settings()) {
      const std::string_view option = option_name(row.option);
      if (option == kNode || option == kHeartbeat) continue;
      each(option, [&](const std::string& text, const Place& where) { apply_to_node(row, text, where); });
    }
    each(kHeartbeat, &Overrides::apply_heartbeat);
    each(kObject, &Overrides::apply_object);
    each(kSignal, &Overrides::apply_signal);
    each(kFault, &Overrides::apply_fault);
    return std::move(found_);
  }

 private:
  /// Those in front, and behind, may have been typed in any order.
  void make_networks() {
    std::map<std::size_t, Place> places;
    for (const Argument& argument : arguments_.at(kNetworkOption)) {
      const Place where = at(kNetworkOption, argument.text);
      if (argument.network == 0) {
        complain(where, "must be 1.." + std::to_string(io::ModbusTcp::kMostNetworks));
      } else {
        places.emplace(argument.network, where);
      }
    }
    for (const auto& [number, where] : places) {
      const std::size_t next = config_.networks.size() + 1;
      if (number > next)
        complain(where, "there is no network " + std::to_string(next) + "; networks have no gaps");
      if (number != next) continue;
      NetworkConfig& made = config_.networks.emplace_back();
      made.number = number;
      made.place = where;
      network_ = &config_.networks.front();
    }
  }

  /// Calls `apply_one` with every argument of the option, for its network; what is said about a network that
  /// has been complained about is left out.
  template <class Apply>
  void each(std::string_view option, Apply apply_one) {
    for (const Argument& argument : arguments_.at(option)) {
      const std::size_t number = network_of(option, argument);
      if (number == 0 || number > config_.networks.size()) continue;
      network_ = &config_.networks[number - 1];
      apply_one(argument.text, at(option, argument.text));
    }
  }
  void each(std::string_view option,
            void (Overrides::*apply_one)(const std::string& text, const Place& where)) {
    each(option, std::bind_front(apply_one, this));
  }

  static Place at(std::string_view option, std::string_view text) {
    return {std::string(option) + " " + std::string(text)};
  }

  void complain(const Place& where, const std::string& message) {
    found_.push_back({where, in_network(network_->number) + message});
  }

  template <class Target>
  bool apply_setting(const Setting<Target>& row, Target& target, const std::string& text,
                     const Place& where) {
    const bool opposite = row.option.starts_with(kOpposite) && (text == "true" || text == "false");
    const Problem problem = assign_text(row, target, opposite ? (text == "true" ? "false" : "true") : text);
    if (!problem.empty()) complain(where, problem);
    return problem.empty();
  }

  /// For a part of an argument; the complaint says which: `--node 300=io.eds: id "300": must be 1..127`.
  template <class Target>
  bool assign_part(const Setting<Target>& row, Target& target, const std::string& text, const Place& where) {
    const Problem problem = assign_text(row, target, text);
    if (!problem.empty()) complain(where, std::string(leaf_of(row.key)) + " \"" + text + "\": " + problem);
    return problem.empty();
  }

  template <class Target>
  static Problem assign_text(const Setting<Target>& row, Target& target, const std::string& text) {
    return assign(row, target, is_text(row.type) ? Value(text) : parse_value(text));
  }

  void apply_modbus(const std::string& text, const Place& where) {
    try {
      const auto address = io::parse_listen_address(text, config_.modbus.port);
      config_.modbus = {address.host, address.port};
    } catch (const io::UsageError& error) {
      complain(where, error.what());
    }
  }

  void apply_node(const std::string& text, const Place& where) {
    const auto parts = split(text, '=');
    if (parts.size() != 2) return complain(where, "must be ID=FILE, such as 5=io_module.eds");
    NodeConfig node;
    node.network = network_->number;
    node.place = where;
    const bool has_id = assign_part(setting_of(node_settings(), "node.id"), node, parts[0], where);
    const bool has_eds = assign_part(setting_of(node_settings(), "node.eds"), node, parts[1], where);
    if (!has_id || !has_eds) return;
    NodeConfig* known = find(node.id);
    if (known == nullptr || known->place.line == 0) {
      network_->nodes.push_back(std::move(node));
    } else {
      known->eds = node.eds;
      known->place = where;
    }
  }

  /// The node of ID=VALUE, split into `parts`; null after a complaint.
  NodeConfig* node_of(const Setting<NodeConfig>& row, const std::vector<std::string>& parts,
                      const Place& where) {
    if (parts.size() == 2) return addressed(parts[0], where);
    complain(where, "must be " + std::string(option_argument(row.option)));
    return nullptr;
  }

  void apply_to_node(const Setting<NodeConfig>& row, const std::string& text, const Place& where) {
    const auto parts = split(text, '=');
    if (NodeConfig* node = node_of(row, parts, where)) assign_part(row, *node, parts[1], where);
  }

  void apply_heartbeat(const std::string& text, const Place& where) {
    const auto& row = setting_of(node_settings(), "node.heartbeat_ms");
    const auto parts = split(text, '=');
    NodeConfig given;
    given.place = where;
    NodeConfig* node = node_of(row, parts, where);
    if (node != nullptr && assign_part(row, given, parts[1], where))
      put_item(node->objects, given.objects.front());
  }

  /// ID:INDEX:SUB=VALUE into `item`; `value_key` is the value's key. The node, or null after a complaint.
  template <class Item>
  NodeConfig* apply_address(std::span<const Setting<Item>> rows, std::string_view value_key,
                            const std::string& text, const std::string& form, Item& item) {
    const auto sides = split(text, '=');
    const auto address = split(sides[0], ':');
    if (sides.size() != 2 || address.size() != 2) {
      complain(item.place, "must be " + form);
      return nullptr;
    }
    const auto object_address = split(address[1], ':');
    const std::string table(table_of(value_key));
    const auto part = [&](const std::string& key, const std::string& typed) {
      return assign_part(setting_of(rows, key), item, typed, item.place);
    };
    bool good = part(table + ".index", object_address[0]);
    if (object_address.size() == 2) good = part(table + ".sub", object_address[1]) && good;
    good = part(std::string(value_key), sides[1]) && good;
    NodeConfig* node = addressed(address[0], item.place);
    return good ? node : nullptr;
  }

  void apply_object(const std::string& text, const Place& where) {
    InitialValue object;
    object.place = where;
    NodeConfig* node = apply_address(object_settings(), "node.objects.value", text,
                                     "ID:INDEX:SUB=VALUE, such as 5:0x2001:0=1", object);
    if (node != nullptr) put_item(node->objects, std::move(object));
  }

  void apply_signal(const std::string& text, const Place& where) {
    const std::vector<std::string> words = words_of(text);
    SignalConfig signal;
    signal.place = where;
    NodeConfig* node = apply_address(
        signal_settings(), kSignalShape, words.empty() ? text : words.front(),
        "ID:INDEX:SUB=SHAPE KEY=VALUE..., such as 5:0x6401:1=sine amplitude=10 period_ms=60000", signal);
    if (node == nullptr || !assign_keys({words.begin() + 1, words.end()}, signal)) return;
    put_item(node->signals, std::move(signal));
  }

  /// key=value each; all that the signal's shape needs has to be there.
  bool assign_keys(const std::vector<std::string>& words, SignalConfig& signal) {
    std::set<std::string> given{"index", "sub", "shape"};
    bool good = true;
    for (const std::string& word : words) {
      const auto sides = split(word, '=');
      good = assign_key(sides[0], sides.size() == 2 ? sides[1] : "", given, signal) && good;
    }
    for (const auto& row : signal_settings()) {
      const std::string key(leaf_of(row.key));
      if (row.example.empty() || !belongs(row, signal) || given.contains(key)) continue;
      complain(signal.place, key + ": is missing; add " + as_word(row.example));
      good = false;
    }
    return good;
  }

  bool assign_key(const std::string& key, const std::string& value, std::set<std::string>& given,
                  SignalConfig& signal) {
    const auto rows = signal_settings();
    const auto row = std::ranges::find(rows, key, [](const auto& r) { return leaf_of(r.key); });
    if (row == rows.end()) {
      complain(signal.place, key + ": no such key; " + keys_of(signal));
    } else if (!given.insert(key).second) {
      complain(signal.place, key + ": is given twice");
    } else {
      return assign_part(*row, signal, value, signal.place);
    }
    return false;
  }

  /// On top of the faults of the plant file.
  void apply_fault(const std::string& text, const Place& where) {
    const auto parts = split(text, ':');
    if (parts.size() != 2)
      return complain(
          where,
          "must be ID:KIND KEY=VALUE... or bus:KIND KEY=VALUE..., such as 5:response-late delay_ms=50");
    const bool of_bus = parts[0] == "bus";
    NodeConfig* node = of_bus ? nullptr : addressed(parts[0], where);
    if (!of_bus && node == nullptr) return;
    sim::FaultOrProblem made =
        sim::parse_fault(parts[1], of_bus ? sim::FaultPlace::kBus : sim::FaultPlace::kNode);
    if (!made.problem.empty()) return complain(where, made.problem);
    (of_bus ? network_->can.faults : node->faults).push_back({made.fault, where});
  }

  /// The node that an argument begins with; null after a complaint.
  NodeConfig* addressed(const std::string& id, const Place& where) {
    NodeConfig wanted;
    if (!assign_part(setting_of(node_settings(), "node.id"), wanted, id, where)) return nullptr;
    NodeConfig* node = find(wanted.id);
    if (node == nullptr) complain(where, "there is no node " + id + "; add --node " + id + "=FILE.eds");
    return node;
  }

  NodeConfig* find(std::uint8_t id) {
    const auto node = std::ranges::find(network_->nodes, id, &NodeConfig::id);
    return node == network_->nodes.end() ? nullptr : &*node;
  }

  const Arguments& arguments_;
  Config& config_;
  NetworkConfig* network_ = &config_.networks.front();  ///< that the argument is about
  Diagnostics found_;
};

}  // namespace

std::vector<std::string_view> setting_options() {
  std::vector<std::string_view> names;
  for_each_setting([&names](const auto& row) {
    const std::string_view name = option_name(row.option);
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  });
  return names;
}

std::size_t network_number(std::string_view text) {
  const auto number = parse_integer(text);
  const auto most = std::int64_t{io::ModbusTcp::kMostNetworks};
  return number && *number >= 1 && *number <= most ? static_cast<std::size_t>(*number) : 0;
}

bool is_flag(std::string_view option) {
  const auto has_no_argument = [option](const auto& row) { return row.option == option; };
  return std::ranges::any_of(settings(), has_no_argument) ||
         std::ranges::any_of(network_settings(), has_no_argument);
}

std::size_t network_of(std::string_view option, const Argument& argument) {
  return has_option(settings(), option) ? 1 : argument.network;
}

bool is_repeatable(std::string_view option) {
  return !has_option(settings(), option) && !has_option(network_settings(), option);
}

Diagnostics apply_options(const Arguments& arguments, Config& config) {
  return Overrides(arguments, config).apply();
}

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#include "app/overrides.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "app/settings.hpp"
#include "app/suggest.hpp"
#include "io/errors.hpp"
#include "io/listen_address.hpp"

namespace cbcan::app {
namespace {

constexpr std::string_view kModbus = "--modbus";
constexpr std::string_view kNoModule = "--no-module";
constexpr std::string_view kNode = "--node";
constexpr std::string_view kName = "--name";
constexpr std::string_view kHeartbeat = "--heartbeat";
constexpr std::string_view kObject = "--object";

/// The parts left and right of the first `mark`; one part where there is none.
std::vector<std::string> split(const std::string& text, char mark) {
  const auto at = text.find(mark);
  if (at == std::string::npos) return {text};
  return {text.substr(0, at), text.substr(at + 1)};
}

/// What the plant file set gives way; what another option set stays, so that check() complains about the two.
void put_object(NodeConfig& node, InitialValue object) {
  const auto same = std::ranges::find_if(node.objects, [&object](const InitialValue& other) {
    return other.index == object.index && other.sub == object.sub && other.place.line != 0;
  });
  if (same != node.objects.end()) node.objects.erase(same);
  node.objects.push_back(std::move(object));
}

class Overrides {
 public:
  Overrides(const Arguments& arguments, Config& config) : arguments_(arguments), config_(config) {}

  Diagnostics apply() {
    for (const auto& row : settings()) {
      const std::string_view option = option_name(row.option);
      if (option == kModbus || option == kNoModule) continue;
      for (const std::string& text : arguments_.at(option))
        apply_setting(row, text, at(option, text));
    }
    each(kModbus, &Overrides::apply_modbus);
    each(kNoModule, &Overrides::apply_no_module);
    each(kNode, &Overrides::apply_node);
    each(kName, &Overrides::apply_name);
    each(kHeartbeat, &Overrides::apply_heartbeat);
    each(kObject, &Overrides::apply_object);
    return std::move(found_);
  }

 private:
  void each(std::string_view option,
            void (Overrides::*apply_one)(const std::string& text, const Place& where)) {
    for (const std::string& text : arguments_.at(option))
      (this->*apply_one)(text, at(option, text));
  }

  static Place at(std::string_view option, std::string_view text) {
    return {std::string(option) + " " + std::string(text)};
  }

  void complain(const Place& where, std::string message) { found_.push_back({where, std::move(message)}); }

  void apply_setting(const Setting<Config>& row, const std::string& text, const Place& where) {
    Problem problem = assign_text(row, config_, text);
    if (!problem.empty()) complain(where, std::move(problem));
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
    const bool parsed =
        row.type != SettingType::kText && row.type != SettingType::kPath && row.type != SettingType::kAddress;
    return assign(row, target, parsed ? parse_value(text) : Value(text));
  }

  void apply_modbus(const std::string& text, const Place& where) {
    try {
      const auto address = io::parse_listen_address(text, config_.modbus.port);
      config_.modbus = {address.host, address.port};
    } catch (const io::UsageError& error) {
      complain(where, error.what());
    }
  }

  /// The opposite of its setting.
  void apply_no_module(const std::string& text, const Place& where) {
    if (text != "true" && text != "false") return complain(where, "must be true or false");
    config_.module.enabled = text == "false";
  }

  void apply_node(const std::string& text, const Place& where) {
    const auto parts = split(text, '=');
    if (parts.size() != 2) return complain(where, "must be ID=FILE, such as 5=io_module.eds");
    NodeConfig node;
    node.place = where;
    const bool has_id = assign_part(setting_of(node_settings(), "node.id"), node, parts[0], where);
    const bool has_eds = assign_part(setting_of(node_settings(), "node.eds"), node, parts[1], where);
    if (!has_id || !has_eds) return;
    NodeConfig* known = find(node.id);
    if (known == nullptr || known->place.line == 0) {
      config_.nodes.push_back(std::move(node));
    } else {
      known->eds = node.eds;
      known->place = where;
    }
  }

  void apply_name(const std::string& text, const Place& where) { apply_to_node("node.name", text, where); }

  void apply_heartbeat(const std::string& text, const Place& where) {
    apply_to_node("node.heartbeat_ms", text, where);
  }

  void apply_to_node(std::string_view key, const std::string& text, const Place& where) {
    const auto& row = setting_of(node_settings(), key);
    const auto parts = split(text, '=');
    if (parts.size() != 2) return complain(where, "must be " + std::string(option_argument(row.option)));
    NodeConfig given;
    given.place = where;
    NodeConfig* node = addressed(parts[0], where);
    if (node == nullptr || !assign_part(row, given, parts[1], where)) return;
    if (!given.name.empty()) node->name = given.name;
    for (InitialValue& object : given.objects)
      put_object(*node, std::move(object));
  }

  void apply_object(const std::string& text, const Place& where) {
    const auto sides = split(text, '=');
    const auto address = split(sides[0], ':');
    if (sides.size() != 2 || address.size() != 2) {
      return complain(where, "must be ID:INDEX:SUB=VALUE, such as 5:0x2001:0=1");
    }
    const auto object_address = split(address[1], ':');
    InitialValue object;
    object.place = where;
    const auto part = [&](std::string_view key, const std::string& typed_part) {
      return assign_part(setting_of(object_settings(), key), object, typed_part, where);
    };
    bool good = part("node.objects.index", object_address[0]);
    if (object_address.size() == 2) good = part("node.objects.sub", object_address[1]) && good;
    good = part("node.objects.value", sides[1]) && good;
    NodeConfig* node = addressed(address[0], where);
    if (node != nullptr && good) put_object(*node, std::move(object));
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
    const auto node = std::ranges::find(config_.nodes, id, &NodeConfig::id);
    return node == config_.nodes.end() ? nullptr : &*node;
  }

  const Arguments& arguments_;
  Config& config_;
  Diagnostics found_;
};

}  // namespace

std::vector<std::string_view> setting_options() {
  std::vector<std::string_view> names;
  const auto add = [&names](const auto& rows) {
    for (const auto& row : rows) {
      const std::string_view name = option_name(row.option);
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  };
  add(settings());
  add(node_settings());
  add(object_settings());
  return names;
}

bool is_repeatable(std::string_view option) {
  constexpr std::array<std::string_view, 4> kOfNodes{kNode, kName, kHeartbeat, kObject};
  return std::ranges::find(kOfNodes, option) != kOfNodes.end();
}

Diagnostics apply_options(const Arguments& arguments, Config& config) {
  return Overrides(arguments, config).apply();
}

}  // namespace cbcan::app

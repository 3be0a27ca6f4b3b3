// SPDX-License-Identifier: MIT
#include "app/plant_file.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <type_traits>
#include <utility>

#include "app/settings.hpp"
#include "app/suggest.hpp"

namespace cbcan::app {
namespace {

std::size_t line_of(const toml::source_region& source) {
  return source.begin.line;
}

/// nullopt for dates, tables and arrays, which no setting is.
std::optional<Value> value_of(const toml::node& node) {
  if (const auto* boolean = node.as_boolean()) return boolean->get();
  if (const auto* integer = node.as_integer()) return integer->get();
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* text = node.as_string()) return text->get();
  return std::nullopt;
}

/// nullopt for what no key of a fault is.
std::optional<sim::FaultValue> fault_value_of(const toml::node& node) {
  if (const auto* integer = node.as_integer()) return integer->get();
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* text = node.as_string()) return std::string_view(text->get());
  return std::nullopt;
}

constexpr std::string_view kNodeTable = "node";

template <class Target>
bool is_section(std::string_view name, std::span<const Setting<Target>> rows) {
  return std::ranges::any_of(rows, [name](const auto& row) { return table_of(row.key) == name; });
}

/// A table that each network has, nodes too.
bool is_of_network(std::string_view name) {
  return name == kNodeTable || is_section(name, network_settings());
}

/// The keys of one table, for a user who is nowhere near any: "can has spec, bit_rate". The empty table is
/// the top of a plant file, or of a network.
std::string contents_of(std::string_view table, bool in_first_network) {
  std::string text;
  for (const std::string_view key : plant_keys()) {
    if (table_of(key) != table || (table.empty() && !in_first_network && !is_of_network(key))) continue;
    text += text.empty() ? "" : ", ";
    text += leaf_of(key);
  }
  if (!table.empty()) return std::string(table) + " has " + text;
  return (in_first_network ? "a plant file has " : "a network has ") + text;
}

constexpr std::string_view kUnix = "unix:";

class Reader {
 public:
  Reader(const std::string& file_name, Config& config) : file_name_(file_name), config_(config) {}

  void read(const toml::table& root) {
    for (const auto& [key, node] : root) {
      if (is_of_network(key.str())) {
        read_of_network(key, node);
      } else if (is_section(key.str(), settings())) {
        read_section(key, node);
      } else if (key.str() == kNetworkTable) {
        read_networks(key, node);
      } else {
        complain_unknown(key, "");
      }
    }
  }

  Diagnostics take() {
    sort_by_place(found_);
    return std::move(found_);
  }

 private:
  bool in_first_network() const { return network_->number == 1; }

  void read_networks(const toml::key& key, const toml::node& node) {
    const bool listed = for_each_table(node, [this](const toml::table& table) { read_network(table); });
    if (!listed)
      complain(line_of(key.source()),
               "network: must be a list of tables; write [[network]] above each network after the first");
  }

  void read_network(const toml::table& table) {
    NetworkConfig network;
    network.number = config_.networks.size() + 1;
    network.place = place(line_of(table.source()));
    network_ = &network;
    for (const auto& [key, node] : table) {
      if (is_of_network(key.str())) {
        read_of_network(key, node);
      } else if (is_section(key.str(), settings())) {
        complain_global(key, std::string(key.str()));
      } else {
        complain_unknown(key, "");
      }
    }
    config_.networks.push_back(std::move(network));
    network_ = &config_.networks.front();
  }

  void read_of_network(const toml::key& key, const toml::node& node) {
    if (key.str() == kNodeTable) {
      read_nodes(key, node);
    } else {
      read_section(key, node);
    }
  }

  void read_section(const toml::key& key, const toml::node& node) {
    const toml::table* const table = node.as_table();
    if (table == nullptr)
      return complain(line_of(key.source()),
                      std::string(key.str()) + ": must be a table; write [" + header(key.str()) + "]");
    read_rows(key.str(), *table, network_settings(), *network_);
    if (in_first_network()) read_rows(key.str(), *table, settings(), config_);
    check_keys(key.str(), *table);
    if (key.str() == "can")
      read_faults(table->get("faults"), "can", sim::FaultPlace::kBus, network_->can.faults);
  }

  /// "node", "network.node": what stands in the brackets.
  std::string header(std::string_view table) const {
    return (in_first_network() ? "" : std::string(kNetworkTable) + ".") + std::string(table);
  }

  void read_nodes(const toml::key& key, const toml::node& node) {
    const bool listed = for_each_table(node, [this](const toml::table& table) { read_node(table); });
    if (!listed)
      complain(line_of(key.source()),
               "node: must be a list of tables; write [[" + header("node") + "]] above each node");
  }

  void read_node(const toml::table& table) {
    NodeConfig node;
    node.network = network_->number;
    node.place = place(line_of(table.source()));
    read_table("node", table, node_settings(), node);
    if (node.id == 0 && !node.lss && !table.contains("id"))
      complain(line_of(table.source()), "node.id: is missing; add id = 5, or lss = true");
    read_list(table.get("objects"), "node.objects", object_settings(), node.objects,
              "{ index = 0x2001, sub = 0, value = 1 }");
    read_list(table.get("signals"), "node.signals", signal_settings(), node.signals,
              "{ index = 0x6401, sub = 1, shape = \"constant\", value = 1 }");
    read_faults(table.get("faults"), "node", sim::FaultPlace::kNode, node.faults);
    network_->nodes.push_back(std::move(node));
  }

  template <class Item>
  void read_list(const toml::node* list, std::string_view name, std::span<const Setting<Item>> rows,
                 std::vector<Item>& items, std::string_view example) {
    for_each_item(list, name, example, [&](const toml::table& table) {
      Item item;
      item.place = place(line_of(table.source()));
      read_table(name, table, rows, item);
      items.push_back(std::move(item));
    });
  }

  void read_faults(const toml::node* list, std::string_view owner, sim::FaultPlace here,
                   std::vector<FaultConfig>& faults) {
    const std::string name = std::string(owner) + ".faults";
    const auto& row = setting_of(fault_settings(), name + ".kind");
    const std::string example = "{ " + std::string(row.example) + " }";
    for_each_item(list, name, example,
                  [&](const toml::table& table) { read_fault(table, row, here, faults); });
  }

  void read_fault(const toml::table& table, const Setting<FaultKindName>& row, sim::FaultPlace here,
                  std::vector<FaultConfig>& faults) {
    const toml::node* const name = table.get(leaf_of(row.key));
    if (name == nullptr) return complain_missing(row, table);
    FaultKindName kind;
    if (!read_setting(row, *name, kind)) return;
    std::vector<sim::FaultKey> keys;
    for (const auto& [key, node] : table) {
      if (&node == name) continue;
      const auto value = fault_value_of(node);
      if (!value)
        return complain(line_of(node.source()), std::string(table_of(row.key)) + ": " + kind.name + ": " +
                                                    std::string(key.str()) +
                                                    ": must be a number, or a text in double quotes");
      keys.push_back({key.str(), *value});
    }
    sim::FaultOrProblem made = sim::make_fault(kind.name, keys, here);
    if (!made.problem.empty())
      return complain(line_of(table.source()), std::string(table_of(row.key)) + ": " + made.problem);
    faults.push_back({made.fault, place(line_of(table.source()))});
  }

  /// `list`: null = it is not there.
  template <class Action>
  void for_each_item(const toml::node* list, std::string_view name, std::string_view example, Action action) {
    if (list == nullptr || for_each_table(*list, action)) return;
    complain(line_of(list->source()), std::string(name) + ": must be a list; write " +
                                          std::string(leaf_of(name)) + " = [" + std::string(example) + "]");
  }

  /// False if `node` is not an array with tables and nothing else in it.
  template <class Action>
  static bool for_each_table(const toml::node& node, Action action) {
    const toml::array* array = node.as_array();
    if (array == nullptr ||
        !std::ranges::all_of(*array, [](const toml::node& item) { return item.is_table(); })) {
      return false;
    }
    for (const toml::node& item : *array)
      action(*item.as_table());
    return true;
  }

  template <class Target>
  void read_table(std::string_view name, const toml::table& table, std::span<const Setting<Target>> rows,
                  Target& target) {
    if (read_rows(name, table, rows, target)) check_keys(name, table);
  }

  /// In the order of the rows, as some depend on those before. False: which keys there can be is not known.
  template <class Target>
  bool read_rows(std::string_view name, const toml::table& table, std::span<const Setting<Target>> rows,
                 Target& target) {
    for (const auto& row : rows) {
      if (table_of(row.key) != name) continue;
      const toml::node* const node = table.get(leaf_of(row.key));
      const bool needed = !row.example.empty() && belongs(row, target);
      const bool good = node != nullptr ? read_setting(row, *node, target) : !needed;
      if (node == nullptr && needed) complain_missing(row, table);
      if (!good && row.key == kSignalShape) return false;
    }
    return true;
  }

  void check_keys(std::string_view name, const toml::table& table) {
    const auto keys = plant_keys();
    for (const auto& [key, node] : table) {
      const std::string full = std::string(name) + "." + std::string(key.str());
      if (std::ranges::find(keys, full) == keys.end()) {
        complain_unknown(key, name);
      } else if (!in_first_network() &&
                 std::ranges::any_of(settings(), [&](const auto& row) { return row.key == full; })) {
        complain_global(key, full);
      }
    }
  }

  template <class Target>
  bool read_setting(const Setting<Target>& row, const toml::node& node, Target& target) {
    const auto value = value_of(node);
    const Problem problem = value ? assign(row, target, based_here(row.type, *value)) : wrong_type(row);
    if constexpr (std::is_same_v<Target, NetworkConfig>)
      if (problem.empty()) target.places[row.key] = place(line_of(node.source()));
    if (problem.empty()) return true;
    const std::string key(row.key);
    complain(line_of(node.source()), (value ? key + " " + value_text(*value) : key) + ": " + problem);
    return false;
  }

  Value based_here(SettingType type, const Value& value) const {
    const auto* path = std::get_if<std::string>(&value);
    if (path == nullptr || path->empty()) return value;
    if (type == SettingType::kPath) return based_here(*path);
    const bool is_socket =
        type == SettingType::kAddress && path->starts_with(kUnix) && path->size() > kUnix.size();
    return is_socket ? std::string(kUnix) + based_here(path->substr(kUnix.size())) : value;
  }

  std::string based_here(std::string_view path) const {
    return (std::filesystem::path(file_name_).parent_path() / path).lexically_normal().string();
  }

  template <class Target>
  void complain_missing(const Setting<Target>& row, const toml::table& table) {
    complain(line_of(table.source()), std::string(row.key) + ": is missing; add " + std::string(row.example));
  }

  void complain_unknown(const toml::key& key, std::string_view table) {
    const std::string full = (table.empty() ? "" : std::string(table) + ".") + std::string(key.str());
    const std::string suggestion = did_you_mean(full, plant_keys());
    complain(line_of(key.source()),
             full + ": no such key" +
                 (suggestion.empty() ? "; " + contents_of(table, in_first_network()) : suggestion));
  }

  void complain_global(const toml::key& key, const std::string& full) {
    complain(line_of(key.source()), full + ": is for all networks; it stands at the top of the file, in [" +
                                        full.substr(0, full.find('.')) + "]");
  }

  void complain(std::size_t line, const std::string& message) {
    found_.push_back({place(line), in_network(network_->number) + message});
  }

  Place place(std::size_t line) const { return {file_name_, line}; }

  const std::string& file_name_;
  Config& config_;
  NetworkConfig* network_ = &config_.networks.front();  ///< that is being read
  Diagnostics found_;
};

/// toml++ says "Error while parsing string: ..."; a word without quotes is what people get wrong most.
std::string syntax_message(std::string_view description) {
  constexpr std::string_view kOpening = "Error while parsing ";
  if (description.starts_with(kOpening)) description.remove_prefix(kOpening.size());
  const bool bare_word = description.find("could not determine value type") != std::string_view::npos;
  return "TOML syntax: " + std::string(description) + (bare_word ? "; texts stand in double quotes" : "");
}

/// The bytes of a character that starts like this; 0 = none does.
std::size_t utf8_length(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first < 0xE0) return 2;
  if (first >= 0xE0 && first < 0xF0) return 3;
  return first >= 0xF0 && first < 0xF5 ? 4 : 0;
}

/// toml++ refuses such a file too, but may name a line further up. 0 = all of it is UTF-8.
std::size_t first_line_not_utf8(std::string_view text) {
  std::size_t line = 1;
  while (!text.empty()) {
    const std::size_t length = utf8_length(static_cast<unsigned char>(text.front()));
    if (length == 0 || length > text.size()) return line;
    const auto tail = text.substr(1, length - 1);
    const auto continues = [](char byte) { return (static_cast<unsigned char>(byte) & 0xC0) == 0x80; };
    if (!std::ranges::all_of(tail, continues)) return line;
    if (text.front() == '\n') ++line;
    text.remove_prefix(length);
  }
  return 0;
}

}  // namespace

Diagnostics read_plant(std::string_view text, const std::string& file_name, Config& into) {
  if (const std::size_t line = first_line_not_utf8(text); line != 0) {
    return {{{file_name, line}, "this line is not UTF-8; save the file as UTF-8"}};
  }
  try {
    const toml::table root = toml::parse(text, std::string_view(file_name));
    Reader reader(file_name, into);
    reader.read(root);
    return reader.take();
  } catch (const toml::parse_error& error) {
    return {{{file_name, line_of(error.source())}, syntax_message(error.description())}};
  }
}

}  // namespace cbcan::app

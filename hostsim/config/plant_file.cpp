// SPDX-License-Identifier: MIT
#include "config/plant_file.hpp"

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <iterator>
#include <optional>

#include "base/address.hpp"
#include "base/text.hpp"
#include "base/toml_table.hpp"
#include "config/plant_settings.hpp"
#include "devices/devices.hpp"

namespace cbcan::config {
namespace {

using base::line_of, base::value_of;

constexpr std::string_view kNodeTable = "node";
constexpr std::string_view kAxisTable = "node.axis";
constexpr std::size_t kLongestLine = 10'000;
constexpr std::size_t kMostMistakes = 100;  // a suggestion for each takes time
constexpr unsigned kMostAdding = 8;

bool is_section(std::string_view name, const auto& rows) {
  return std::ranges::any_of(rows, [name](const Row& row) { return base::table_of(row.key) == name; });
}

bool is_global(std::string_view key) {
  return std::ranges::find(kPlantSettings, key, &Row::key) != kPlantSettings.end();
}

/// A table that each network has, or the list of nodes.
bool is_of_network(std::string_view name) {
  return name == kNodeTable || is_section(name, kNetworkSettings);
}

/// The keys of one table, if no key is similar: "can has spec, bit_rate". The empty table is the top of a
/// plant file or of a network.
std::string contents_of(std::string_view table, bool in_first_network) {
  std::vector<std::string_view> keys;
  for (const std::string_view key : plant_keys())
    if (base::table_of(key) == table && (!table.empty() || in_first_network || is_of_network(key)))
      keys.push_back(base::leaf_of(key));
  const std::string_view top = in_first_network ? "a plant file" : "a network";
  return fmt::format("{} has {}", table.empty() ? top : table, base::listed(keys, ", "));
}

/// Its number from 1; 0 = none. Within a line the parser's stack grows with each part of a key.
std::size_t line_too_long(std::string_view text) {
  for (std::size_t line = 1; !text.empty(); ++line)
    if (base::take_line(text).size() > kLongestLine) return line;
  return 0;
}

class Reader {
 public:
  /// `read`: for the plant file that this one adds to; null = there can be none. `adding`: files that add to
  /// this one.
  Reader(const std::string& file_name, Config& config, const base::FileReader* read, unsigned adding)
      : file_name_(file_name), read_(read), adding_(adding), config_(config) {}
  /// Reads a change by --set: `where` is what was typed; paths stay as they are.
  Reader(Config& config, NetworkConfig& network, Place where)
      : config_(config), network_(&network), change_(std::move(where)) {}

  Diagnostics read_text(std::string_view text, std::span<const std::string_view> others) {
    // toml++ rejects such a file too, but may name an earlier line.
    if (const std::size_t line = base::first_line_not_utf8(text); line != 0)
      return {{{file_name_, line}, "this line is not UTF-8; save the file as UTF-8"}};
    if (const std::size_t line = line_too_long(text); line != 0)
      return {
          {{file_name_, line},
           fmt::format("a line of more than {} characters; write a list in several lines", kLongestLine)}};
    try {
      return read_file(toml::parse(text, std::string_view(file_name_)), others);
    } catch (const toml::parse_error& error) {
      return {{{file_name_, line_of(error)}, base::syntax_message(error.description())}};
    }
  }

  Diagnostics read_file(const toml::table& root, std::span<const std::string_view> others) {
    try {
      if (change_)
        change(root);
      else
        read(root, others);
    } catch (const TooManyErrors&) {
      found_.push_back(
          {{file_name_, 0},
           fmt::format("{} mistakes, and the rest of the file has not been checked; correct these first",
                       kMostMistakes)});
    }
    sort_by_place(found_);
    return std::move(found_);
  }

 private:
  struct TooManyErrors {};

  /// The top of the file, or a network.
  void read(const toml::table& root, std::span<const std::string_view> others = {}) {
    const toml::node* const base = read_ != nullptr && in_first_network() ? root.get(kBasePlant) : nullptr;
    if (base != nullptr) read_base(*base, others);
    for (const auto& [key, node] : root) {
      const std::string_view name = key.str();
      const bool is_elsewhere = in_first_network() && name == kExploreTable;
      if (is_elsewhere || &node == base || std::ranges::find(others, name) != others.end()) continue;
      check_place(root, name, key);
      if (name == kNodeTable) {
        read_tables(key, node, "node", &Reader::read_node);
      } else if (is_of_network(name) || (in_first_network() && is_section(name, kPlantSettings))) {
        read_section(key, node);
      } else if (in_first_network() && name == kNetworkTable) {
        read_tables(key, node, "network after the first", &Reader::read_network);
      } else if (in_first_network() && name == kWireTable) {
        read_list(&node, kWireTable, kWireSettings, config_.wires,
                  "from = \"66:output:1\", to = \"5:0x2001\"");
      } else if (name == kWireTable || is_section(name, kPlantSettings)) {
        complain_global(key, name);
      } else {
        complain_unknown(key, "");
      }
    }
  }

  /// Reads the base, before everything else in this file.
  void read_base(const toml::node& node, std::span<const std::string_view> others) {
    const auto* const name = node.as_string();
    if (name == nullptr) return complain(node, "plant: must be a text: demo, or the path of a plant file");
    const std::string path =
        name->get() == kDemo ? std::string(kDemoPlant) : base::path_in(file_name_, name->get());
    const auto text = (*read_)(path);
    if (!text)
      return complain(node, fmt::format("plant {}: cannot be read; paths are relative to this file", path));
    const std::string other = base::other_kind(path, *text, base::kPlantFile);
    if (!other.empty() && !base::other_kind(path, *text, base::kScenario).empty())
      return complain(node, fmt::format("plant {}: {}", path, other));
    if (adding_ == kMostAdding)
      return complain(node, fmt::format("plant {}: at most {} plants add to another", path, kMostAdding));
    std::ranges::move(Reader(path, config_, read_, adding_ + 1).read_text(*text, others),
                      std::back_inserter(found_));
  }

  /// A table after [[network]] may be meant for that network, but belongs to the first one.
  void check_place(const toml::table& root, std::string_view name, const toml::key& key) {
    const toml::node* const networks = in_first_network() ? root.get(kNetworkTable) : nullptr;
    const bool is_first = networks == nullptr || line_of(key) < line_of(*networks);
    if (is_first || !is_of_network(name) || is_section(name, kPlantSettings)) return;
    complain(key, fmt::format("{0}: is of the first network; put it above [[network]], or write network.{0}",
                              name));
  }

  bool in_first_network() const { return network_->number == 1; }

  void read_tables(const toml::key& key, const toml::node& node, std::string_view each,
                   void (Reader::*read_one)(const toml::table&)) {
    if (!for_each_table(node, [&](const toml::table& table) { (this->*read_one)(table); }))
      complain(key, fmt::format("{}: must be a list of tables; write [[{}]] above each {}", key.str(),
                                header(key.str()), each));
  }

  void read_network(const toml::table& table) {
    NetworkConfig network;
    network.number = config_.networks.size() + 1;
    network.place = place(table);
    network_ = &network;
    read(table);
    config_.networks.push_back(std::move(network));
    network_ = &config_.networks.front();
  }

  void read_section(const toml::key& key, const toml::node& node) {
    const toml::table* const table = node.as_table();
    if (table == nullptr)
      return complain(key, fmt::format("{}: must be a table; write [{}]", key.str(), header(key.str())));
    read_rows(key.str(), *table, kNetworkSettings, *network_);
    if (in_first_network()) read_rows(key.str(), *table, kPlantSettings, config_);
    check_keys(key.str(), *table);
    for (const auto& [section, place] : {std::pair("can", "bus"), std::pair("plc", "plc")})
      if (const auto list = faults_at(*network_, place); key.str() == section)
        read_faults(table->get("faults"), fmt::format("{}.faults", section), list->place, *list->faults);
  }

  /// The text in the brackets: "node", "network.node".
  std::string header(std::string_view table) const {
    return fmt::format("{}{}", in_first_network() ? "" : "network.", table);
  }

  void read_node(const toml::table& table) {
    NodeConfig node;
    node.network = network_->number;
    node.place = place(table);
    read_table("node", table, kNodeSettings, node);
    if (node.id == 0 && !node.lss && !table.contains("id") && !is_misspelt("node.id", table))
      complain(table, "node.id: is missing; add id = 5, or lss = true");
    if (node.device.empty() && devices::is_script(node.eds))
      complain(*table.get("eds"), "node.eds: a Lua script is a device; write device = \"FILE.lua\"");
    read_parts(table, node);
    network_->nodes.push_back(std::move(node));
  }

  void read_parts(const toml::table& table, NodeConfig& node) {
    read_list(table.get("objects"), "node.objects", kObjectSettings, node.objects,
              "index = 0x2001, sub = 0, value = 1");
    read_list(table.get("signals"), "node.signals", kSignalSettings, node.signals,
              "index = 0x6401, sub = 1, shape = \"constant\", value = 1");
    read_faults(table.get("faults"), "node.faults", sim::FaultPlace::kNode, node.faults);
    if (const toml::node* const axis = table.get("axis")) read_axis(*axis, node);
  }

  /// `axis.2` is the second one, in the same way.
  void read_axis(const toml::node& axis, NodeConfig& node, std::size_t number = 1) {
    if (!axis.is_table())
      return complain(axis, "node.axis: must be a table; write axis = { inertia_kgcm2 = 10 }");
    node.axes.resize(std::max(node.axes.size(), number));
    read_table(kAxisTable, *axis.as_table(), kAxisSettings, node.axes[number - 1]);
    for (const auto& [key, other] : *axis.as_table())
      if (const auto of = axis_number(key.str()))
        number == 1 ? read_axis(other, node, *of) : complain_unknown(key, kAxisTable);
  }

  /// `root` is a table with one key, or a list to be appended.
  void change(const toml::table& root) {
    if (is_of_plant(root)) network_ = &config_.networks.front();
    const toml::table* const networks = root[kNetworkTable].as_table();
    if (networks == nullptr) return change_network(root);
    const auto [key, node] = *networks->begin();
    const auto number = base::parse_integer(key.str());
    if (!number || *number < 1 || *number > static_cast<std::int64_t>(config_.networks.size()))
      return complain(
          key, fmt::format("there is no network {}; there are 1..{}", key.str(), config_.networks.size()));
    if (!node.is_table()) return complain(key, "must be network.N.TABLE.KEY, such as network.2.can.bit_rate");
    network_ = &config_.networks[static_cast<std::size_t>(*number) - 1];
    change_network(*node.as_table());
  }

  /// Whether a table describes the plant, not a single network.
  static bool is_of_plant(const toml::table& root) {
    const auto [key, node] = *root.begin();
    const toml::table* const table = node.as_table();
    const std::string full =
        fmt::format("{}.{}", key.str(), table != nullptr ? (*table->begin()).first.str() : "");
    return !is_of_network(key.str()) || is_global(full);
  }

  void change_network(const toml::table& root) {
    const toml::table* const nodes = root[kNodeTable].as_table();
    if (nodes == nullptr) return read(root);
    const auto [key, table] = *nodes->begin();
    NodeConfig* const node = find_node(*network_, key.str());
    if (node == nullptr)
      return complain(key, fmt::format("there is no node {0}; add --node {0}=FILE.eds", key.str()));
    if (!table.is_table()) return complain(key, "must be node.ID.KEY, such as node.5.heartbeat_ms");
    change_node(*table.as_table(), *node);
  }

  /// Values and signals of an object replace those of the plant file.
  void change_node(const toml::table& table, NodeConfig& node) {
    const Place place = std::exchange(node.place, *change_);
    if (table.contains("modules")) node.modules.clear();
    read_rows("node", table, kNodeSettings, node, false);
    check_keys("node", table);
    read_parts(table, node);
    node.place = place;
    keep_last(node.objects);
    keep_last(node.signals);
  }

  template <class Item>
  static void keep_last(std::vector<Item>& items) {
    if (items.empty() || items.back().place.line != 0) return;
    const Item last = items.back();
    std::erase_if(items, [&last](const Item& item) {
      return item.place.line != 0 && object_of(item) == object_of(last);
    });
  }

  template <class Item>
  void read_list(const toml::node* list, std::string_view name, std::span<const Setting<Item>> rows,
                 std::vector<Item>& items, std::string_view example) {
    for_each_item(list, name, example, [&](const toml::table& table) {
      Item item;
      item.place = place(table);
      read_table(name, table, rows, item);
      items.push_back(std::move(item));
    });
  }

  void read_faults(const toml::node* list, std::string_view name, sim::FaultPlace here,
                   std::vector<FaultConfig>& faults) {
    const auto& row = setting_of(kFaultKindSettings, fmt::format("{}.kind", name));
    for_each_item(list, name, fmt::format("kind = {}", row.example), [&](const toml::table& table) {
      std::string kind;
      const toml::node* const given = table.get("kind");
      if (given == nullptr) return complain_missing(row, table);
      if (!read_setting(row, *given, kind)) return;
      const sim::FaultOrProblem made = sim::make_fault(kind, keys_of_fault(table), here);
      if (!made.problem.empty()) return complain(table, fmt::format("{}: {}", name, made.problem));
      faults.push_back({made.fault, place(table)});
    });
  }

  /// All keys except the kind.
  static std::vector<sim::FaultKey> keys_of_fault(const toml::table& table) {
    std::vector<sim::FaultKey> keys;
    for (const auto& [key, node] : table)
      if (key.str() != "kind") keys.push_back({key.str(), value_of(node)});
    return keys;
  }

  /// `list` may be null.
  template <class Action>
  void for_each_item(const toml::node* list, std::string_view name, std::string_view example, Action action) {
    if (list == nullptr || for_each_table(*list, action)) return;
    complain(*list,
             fmt::format("{}: must be a list; write {} = [{{ {} }}]", name, base::leaf_of(name), example));
  }

  /// False if `node` is not an array of tables.
  template <class Action>
  static bool for_each_table(const toml::node& node, Action action) {
    const toml::array* array = node.as_array();
    if (array == nullptr || !std::ranges::all_of(*array, &toml::node::is_table)) return false;
    for (const toml::node& item : *array)
      action(*item.as_table());
    return true;
  }

  template <class Target>
  void read_table(std::string_view name, const toml::table& table, std::span<const Setting<Target>> rows,
                  Target& target) {
    if (read_rows(name, table, rows, target)) check_keys(name, table);
  }

  /// Reads keys in the order of the rows, as some depend on those before. `whole`: missing required keys are
  /// reported. False: the allowed keys are not known.
  template <class Target>
  bool read_rows(std::string_view name, const toml::table& table, std::span<const Setting<Target>> rows,
                 Target& target, bool whole = true) {
    for (const auto& row : rows) {
      if (base::table_of(row.key) != name) continue;
      const toml::node* const node = table.get(base::leaf_of(row.key));
      const bool needed = whole && !row.example.empty() && belongs(row, target);
      const bool good = node != nullptr ? read_setting(row, *node, target) : !needed;
      const bool misspelt = node == nullptr && needed && is_misspelt(row.key, table);
      if (node == nullptr && needed && !misspelt) complain_missing(row, table);
      if (!good && row.key == kSignalShape) return misspelt;
    }
    return true;
  }

  /// The key is missing, but an unknown key, which is reported, is probably a misspelling of it.
  static bool is_misspelt(std::string_view key, const toml::table& table) {
    const auto& keys = plant_keys();
    return std::any_of(table.begin(), table.end(), [&](const auto& each) {
      const std::string full = fmt::format("{}.{}", base::table_of(key), each.first.str());
      return std::ranges::find(keys, full) == keys.end() && base::nearest(full, keys) == key;
    });
  }

  void check_keys(std::string_view name, const toml::table& table) {
    const auto& keys = plant_keys();
    for (const auto& [key, node] : table) {
      const std::string full = fmt::format("{}.{}", name, key.str());
      if (name == kAxisTable && axis_number(key.str())) continue;  // read_axis() has them
      if (std::ranges::find(keys, full) == keys.end()) {
        complain_unknown(key, name);
      } else if (!in_first_network() && is_global(full)) {
        complain_global(key, full);
      }
    }
  }

  template <class Target>
  bool read_setting(const Setting<Target>& row, const toml::node& node, Target& target) {
    const toml::array* const list = row.form == base::Form::kLines ? node.as_array() : nullptr;
    if (list != nullptr && std::ranges::none_of(*list, &toml::node::is_array))
      return std::ranges::all_of(*list, [&](const auto& item) { return read_setting(row, item, target); });
    auto value = value_of(node);
    if (change_ && node.is_string()) value = base::typed(row, node.as_string()->get());
    const Problem problem = assign(row, target, based_here(row, value), place(node));
    if (problem.empty()) return true;
    complain(node, fmt::format("{}{}: {}", row.key, value ? " " + base::value_text(*value) : "", problem));
    return false;
  }

  std::optional<Value> based_here(const Row& row, const std::optional<Value>& value) const {
    const auto* path = value ? std::get_if<std::string>(&*value) : nullptr;
    if (path == nullptr || path->empty()) return value;
    const bool is_path =
        row.form == base::Form::kPath || (row.key == "node.device" && devices::is_script(*path));
    if (is_path) return base::path_in(file_name_, *path);
    if (row.form != base::Form::kAddress) return value;
    for (const std::string_view kind : {base::kUnix, base::kPty})
      if (path->starts_with(kind) && path->size() > kind.size())
        return std::string(kind) + base::path_in(file_name_, path->substr(kind.size()));
    return value;
  }

  void complain_missing(const Row& row, const toml::table& table) {
    complain(table, fmt::format("{}: is missing; add {} = {}", row.key, base::leaf_of(row.key), row.example));
  }

  void complain_unknown(const toml::key& key, std::string_view table) {
    const std::string full = fmt::format("{}{}{}", table, table.empty() ? "" : ".", key.str());
    const std::string suggestion =
        full == kDemo ? "; write plant = \"demo\"" : base::did_you_mean(full, plant_keys());
    complain(key, full + ": no such key" +
                      (suggestion.empty() ? "; " + contents_of(table, in_first_network()) : suggestion));
  }

  void complain_global(const toml::key& key, std::string_view full) {
    complain(key, fmt::format("{}: is for all networks; write it at the top of the file, in [{}]", full,
                              full.substr(0, full.find('.'))));
  }

  /// `where`: a key, or its value.
  void complain(const auto& where, const std::string& message) {
    if (found_.size() == kMostMistakes) throw TooManyErrors();
    found_.push_back({place(where), in_network(network_->number) + message});
  }

  Place place(const auto& where) const { return change_ ? *change_ : Place{file_name_, line_of(where)}; }

  const std::string file_name_;
  const base::FileReader* read_ = nullptr;
  unsigned adding_ = 0;
  Config& config_;
  NetworkConfig* network_ = &config_.networks.front();  ///< the one being read
  std::optional<Place> change_;                         ///< set for changes that come from no file
  Diagnostics found_;
};

/// "can.bit_rate" and a value as a table; "wire+" appends the value to a list.
toml::table table_with(std::string_view path, auto value) {
  const bool adds = path.ends_with('+');
  toml::table root = toml::parse(fmt::format("{} = 0", path.substr(0, path.size() - (adds ? 1 : 0))));
  toml::table* table = &root;
  while (toml::table* const inner = (*table->begin()).second.as_table())
    table = inner;
  const std::string key((*table->begin()).first.str());
  if (adds)
    table->insert_or_assign(key, toml::array{std::move(value)});
  else
    table->insert_or_assign(key, std::move(value));
  return root;
}

/// `make` returns a table with the change.
Diagnostics changed(const Place& place, Config& config, NetworkConfig& network, auto make) try {
  return Reader(config, network, place).read_file(make(), {});
} catch (const toml::parse_error& error) {
  return {{place, base::syntax_message(error.description())}};
}

}  // namespace

Diagnostics change_plant(std::string_view change, const Place& place, Config& config,
                         NetworkConfig& network) {
  const auto sides = base::split(change, '=');
  if (!sides || sides->first.empty())
    return {{place,
             "must be PATH=VALUE, such as can.bit_rate=125000; docs/reference/plant-file.md has the keys"}};
  return changed(place, config, network, [sides] {
    const auto [path, value] = *sides;
    if (path.ends_with('+'))
      return toml::parse(fmt::format("{} = [{}]", path.substr(0, path.size() - 1), value));
    // A value without braces, brackets and quotes is a text here; the setting decides what it means.
    const bool is_toml = !value.empty() && std::string_view("{[\"'").find(value.front()) != value.npos;
    return is_toml ? toml::parse(fmt::format("{} = {}", path, value)) : table_with(path, std::string(value));
  });
}

Diagnostics change_plant(std::string_view table, std::span<const TextKey> keys, const Place& place,
                         Config& config, NetworkConfig& network) {
  toml::table changes;
  for (const auto& [key, text] : keys)
    if (!changes.insert(key, std::string(text)).second)
      return {{place, fmt::format("{}: is given twice", key)}};
  return changed(place, config, network, [&] { return table_with(table, std::move(changes)); });
}

Diagnostics read_plant(std::string_view text, const std::string& file_name, Config& into,
                       std::span<const std::string_view> others, const base::FileReader* read) {
  return Reader(file_name, into, read, 0).read_text(text, others);
}

}  // namespace cbcan::config

// SPDX-License-Identifier: MIT
#include "cli/options.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "config/settings.hpp"
#include "text/address.hpp"
#include "text/error.hpp"
#include "text/numbers.hpp"
#include "text/suggestion.hpp"
#include "text/words.hpp"

namespace cbcan::cli {
namespace {

using text::leaf_of;
using text::Problem;
using text::Row;
using text::Setting;

constexpr std::string_view kOpposite = "--no-";

// clang-format off
constexpr auto kRows = std::to_array<Row>({
    {.key = "plant.demo", .option = kDemoOption,
     .help = "The built-in plant: an I/O module (node 42h = 66), two pressure transducers (1, 2), a drive (10h = 16), "
             "a generic node (20h = 32)"},
    {.key = "plant.config", .option = "--config FILE", .help = "A plant file in TOML; docs/reference/plant-file.md explains it"},
    {.key = "plant.check", .option = "--check",
     .help = "Reads plant and EDS files, reports mistakes, and ends: exit code 0 or 2"},
    {.key = "network.number", .option = "--network N",
     .help = "Following options about module, CAN, log file and nodes apply to network N, earlier ones to network 1; "
             "the Modbus unit ID selects the network",
     .form = text::Form::kInteger, .low = 1, .high = std::int64_t{config::kMostNetworks}},
    {.key = "help.help", .option = "-h, --help", .help = "Print this text"},
    {.key = "help.version", .option = "--version", .help = "Print the version"},
    {.option = "--node ID=FILE", .help = "A node; one that the plant has gets this file instead"},
    {.option = "--object ID:INDEX:SUB=VALUE", .help = "A value at power-on; without a SUB ID:INDEX=VALUE"},
    {.option = "--signal ID:INDEX:SUB=SHAPE KEY=VALUE...",
     .help = "An input of the node gets values over time; all of it one argument: --signal \"5:0x6401:1=sine "
             "amplitude=50 period_ms=60000\". Keys in brackets have defaults; docs/reference/plant-file.md explains them"},
    {.option = "--fault ID:KIND KEY=VALUE...",
     .help = "A fault of the node, one argument: --fault \"5:response-late delay_ms=50 count=1\"; docs/reference/faults.md lists "
             "kinds and keys"},
    {.option = "--axis ID:KEY=VALUE...",
     .help = "What a drive moves, one argument: --axis \"16:inertia_kgcm2=10 friction_mnm=50\""},
    {.option = "--wire FROM=TO KEY=VALUE...",
     .help = "Connects an output or object to an input, one argument: --wire \"66:output:1=5:0x2001 scale=100\""},
    {.option = "--fault bus:KIND KEY=VALUE...", .help = "A fault of the bus"},
});
// clang-format on

/// What the plant file set gives way; what another option set stays, so that check() complains about the two.
template <class Item>
void put_item(std::vector<Item>& items, Item item) {
  std::erase_if(items, [&item](const Item& other) {
    return config::same_object(other, item) && other.place.line != 0;
  });
  items.push_back(std::move(item));
}

bool has_option(const auto& rows, std::string_view option) {
  return std::ranges::any_of(rows, [option](const Row& row) { return option_name(row.option) == option; });
}

class Options {
 public:
  Options(const Arguments& arguments, config::Config& config) : arguments_(arguments), config_(config) {}

  config::Diagnostics apply() {
    make_networks();
    apply_rows(config::network_settings(), [this]() -> config::NetworkConfig& { return *network_; });
    apply_rows(config::settings(), [this]() -> config::Config& { return config_; });
    each("--modbus", [this](const auto& text) { apply_modbus(text); });
    each("--node", [this](const auto& text) { apply_node(text); });
    for (const auto& row : config::node_settings())
      if (option_name(row.option) != "--node")
        each(row.option, [&](const auto& text) { apply_to_node(row, text); });
    each("--object", [this](const auto& text) { apply_object(text); });
    each("--signal", [this](const auto& text) { apply_signal(text); });
    each("--fault", [this](const auto& text) { apply_fault(text); });
    each("--axis", [this](const auto& text) { apply_axis(text); });
    each("--wire", [this](const auto& text) { apply_wire(text); });
    return std::move(found_);
  }

 private:
  /// Those in front, and behind, may have been typed in any order.
  void make_networks() {
    std::map<std::size_t, config::Place> places;
    for (const Argument& argument : arguments_) {
      if (argument.option != kNetworkOption) continue;
      where_ = at(kNetworkOption, argument.text);
      if (argument.network == 0) {
        complain(fmt::format("must be 1..{}", config::kMostNetworks));
      } else {
        places.emplace(argument.network, where_);
      }
    }
    for (const auto& [number, where] : places) {
      where_ = where;
      const std::size_t next = config_.networks.size() + 1;
      if (number > next) complain(fmt::format("there is no network {}; networks have no gaps", next));
      if (number != next) continue;
      config::NetworkConfig& made = config_.networks.emplace_back();
      made.number = number;
      made.place = where;
      network_ = &config_.networks.front();
    }
  }

  /// Calls `apply_one` with every argument of the option, for its network; what is said about a network that
  /// has been complained about is left out.
  template <class Apply>
  void each(std::string_view option, Apply apply_one) {
    for (const Argument& argument : arguments_) {
      if (argument.option != option_name(option)) continue;
      if (argument.network == 0 || argument.network > config_.networks.size()) continue;
      network_ = &config_.networks[argument.network - 1];
      where_ = at(argument.option, argument.text);
      apply_one(argument.text);
    }
  }

  static config::Place at(std::string_view option, std::string_view text) {
    return {fmt::format("{} {}", option, text)};
  }

  void complain(const std::string& message) {
    found_.push_back({where_, config::in_network(network_->number) + message});
  }

  /// Of rows with the same option the first one says what becomes of it.
  template <class Target, class Find>
  void apply_rows(std::span<const Setting<Target>> rows, Find target) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (rows[i].key.starts_with("modbus.") || (i != 0 && rows[i].option == rows[i - 1].option)) continue;
      const bool is_list = option_argument(rows[i].option).find(',') != std::string_view::npos;
      each(rows[i].option, [&](const auto& text) {
        is_list ? apply_list(rows, rows[i], target(), text) : apply_setting(rows[i], target(), text);
      });
    }
  }

  template <class Target>
  static std::string no_such_key(std::span<const Setting<Target>> rows, const Row& first,
                                 std::string_view key) {
    std::vector<std::string_view> known;
    for (const Row& row : rows)
      if (text::table_of(row.key) == text::table_of(first.key)) known.push_back(leaf_of(row.key));
    return fmt::format("{}: no such key{}", key, text::did_you_mean(key, known));
  }

  /// Values between commas, in the order of the rows from `first` on, and KEY=VALUE for any of its table.
  template <class Target>
  void apply_list(std::span<const Setting<Target>> rows, const Setting<Target>& first, Target& target,
                  std::string_view text) {
    const Setting<Target>* next = &first;
    for (bool more = true; more;) {
      const auto parts = text::split(text, ',');
      const std::string_view part = parts ? parts->first : text;
      more = parts.has_value();
      if (more) text = parts->second;
      if (const auto sides = text::split(part, '=')) {
        const std::string key = fmt::format("{}.{}", text::table_of(first.key), sides->first);
        const auto row = std::ranges::find(rows, std::string_view(key), &Row::key);
        if (row == rows.end()) return complain(no_such_key(rows, first, sides->first));
        assign_part(*row, target, sides->second);
      } else if (next == rows.data() + rows.size() || next->option != first.option) {
        return complain(fmt::format("\"{}\" is too much; must be {}", part, option_argument(first.option)));
      } else {
        assign_part(*next++, target, part);
      }
    }
  }

  template <class Target>
  void apply_setting(const Setting<Target>& row, Target& target, std::string_view text) {
    if (row.option.starts_with(kOpposite)) text = text == "true" ? "false" : text == "false" ? "true" : text;
    if (const Problem problem = config::assign(row, target, text::typed(row, text), where_); !problem.empty())
      complain(problem);
  }

  /// For a part of an argument; the complaint says which: `--node 300=io.eds: id "300": must be 1..127`.
  template <class Target>
  bool assign_part(const Setting<Target>& row, Target& target, std::string_view text) {
    const Problem problem = config::assign(row, target, text::typed(row, text), where_);
    if (!problem.empty()) complain(fmt::format("{} \"{}\": {}", leaf_of(row.key), text, problem));
    return problem.empty();
  }

  void apply_modbus(const std::string& text) {
    try {
      config_.modbus = text::parse_listen_address(text, config_.modbus.port);
    } catch (const text::UsageError& error) {
      complain(error.what());
    }
  }

  void apply_node(const std::string& text) {
    const auto sides = text::split(text, '=');
    if (!sides) return complain("must be ID=FILE, such as 5=io_module.eds");
    config::NodeConfig node;
    node.network = network_->number;
    node.place = where_;
    const bool has_id =
        assign_part(config::setting_of(config::node_settings(), "node.id"), node, sides->first);
    const bool has_eds =
        assign_part(config::setting_of(config::node_settings(), "node.eds"), node, sides->second);
    if (!has_id || !has_eds) return;
    config::NodeConfig* known = find(node.id);
    if (known == nullptr || known->place.line == 0) {
      network_->nodes.push_back(std::move(node));
    } else {
      known->eds = node.eds;
      known->place = where_;
    }
  }

  /// A heartbeat is an object of the node.
  void apply_to_node(const Setting<config::NodeConfig>& row, const std::string& text) {
    const auto sides = text::split(text, '=');
    if (!sides) return complain(fmt::format("must be {}", option_argument(row.option)));
    config::NodeConfig* const node = addressed(sides->first);
    if (node == nullptr) return;
    config::NodeConfig changed = *node;
    changed.place = where_;
    changed.objects.clear();
    if (!assign_part(row, changed, sides->second)) return;
    for (config::InitialValue& object : std::exchange(changed.objects, std::move(node->objects)))
      put_item(changed.objects, std::move(object));
    changed.place = node->place;
    *node = std::move(changed);
  }

  /// ID:INDEX:SUB=VALUE into `item`; `value_key` is the value's key. The node, or null after a complaint.
  template <class Item>
  config::NodeConfig* apply_address(std::span<const Setting<Item>> rows, std::string_view value_key,
                                    std::string_view text, std::string_view form, Item& item) {
    const auto sides = text::split(text, '=');
    const auto address = sides ? text::split(sides->first, ':') : std::nullopt;
    if (!address) return complain(fmt::format("must be {}", form)), nullptr;
    const auto part = [&](std::string_view key, std::string_view typed) {
      const std::string full = fmt::format("{}.{}", text::table_of(value_key), key);
      return assign_part(config::setting_of(rows, full), item, typed);
    };
    const auto object = text::split(address->second, ':');
    bool good = part("index", object ? object->first : address->second);
    if (object) good = part("sub", object->second) && good;
    good = part(leaf_of(value_key), sides->second) && good;
    config::NodeConfig* node = addressed(address->first);
    return good ? node : nullptr;
  }

  void apply_object(const std::string& text) {
    config::InitialValue object;
    object.place = where_;
    config::NodeConfig* node = apply_address(config::object_settings(), "node.objects.value", text,
                                             "ID:INDEX:SUB=VALUE, such as 5:0x2001:0=1", object);
    if (node != nullptr) put_item(node->objects, std::move(object));
  }

  void apply_signal(const std::string& text) {
    const auto words = text::words_of(text);
    config::SignalConfig signal;
    signal.place = where_;
    config::NodeConfig* node = apply_address(
        config::signal_settings(), config::kSignalShape, words.empty() ? text : words.front(),
        "ID:INDEX:SUB=SHAPE KEY=VALUE..., such as 5:0x6401:1=sine amplitude=10 period_ms=60000", signal);
    if (node == nullptr || !assign_keys(std::span(words).subspan(1), signal)) return;
    put_item(node->signals, std::move(signal));
  }

  /// key=value each; all that the signal's shape needs has to be there.
  bool assign_keys(std::span<const std::string_view> words, config::SignalConfig& signal) {
    std::set<std::string_view> given{"index", "sub", "shape"};
    bool good = true;
    for (const std::string_view word : words) {
      const auto sides = text::split(word, '=').value_or(std::pair(word, std::string_view()));
      good = assign_key(sides.first, sides.second, given, signal) && good;
    }
    for (const Row& row : config::signal_settings()) {
      if (row.example.empty() || !config::belongs(row, signal) || given.contains(leaf_of(row.key))) continue;
      std::string example(row.example);
      std::erase(example, '"');
      complain(fmt::format("{0}: is missing; add {0}={1}", leaf_of(row.key), example));
      good = false;
    }
    return good;
  }

  bool assign_key(std::string_view key, std::string_view value, std::set<std::string_view>& given,
                  config::SignalConfig& signal) {
    const auto rows = config::signal_settings();
    const auto row = std::ranges::find(rows, key, [](const Row& r) { return leaf_of(r.key); });
    if (row == rows.end()) {
      complain(fmt::format("{}: no such key; {}", key, config::keys_of(signal)));
    } else if (!given.insert(key).second) {
      complain(fmt::format("{}: is given twice", key));
    } else {
      return assign_part(*row, signal, value);
    }
    return false;
  }

  /// On top of the faults of the plant file.
  void apply_fault(const std::string& text) {
    const auto parts = text::split(text, ':');
    if (!parts)
      return complain(
          "must be ID:KIND KEY=VALUE... or bus:KIND KEY=VALUE..., such as 5:response-late delay_ms=50");
    const bool of_bus = parts->first == "bus";
    config::NodeConfig* node = of_bus ? nullptr : addressed(parts->first);
    if (!of_bus && node == nullptr) return;
    const sim::FaultOrProblem made =
        sim::parse_fault(parts->second, of_bus ? sim::FaultPlace::kBus : sim::FaultPlace::kNode);
    if (!made.problem.empty()) return complain(made.problem);
    (of_bus ? network_->can.faults : node->faults).push_back({made.fault, where_});
  }

  /// key=value each.
  template <class Target>
  bool assign_words(std::span<const Setting<Target>> rows, std::span<const std::string_view> words,
                    Target& target) {
    bool good = true;
    for (const std::string_view word : words) {
      const auto [key, value] = text::split(word, '=').value_or(std::pair(word, std::string_view()));
      const auto row = std::ranges::find(rows, key, [](const Row& r) { return leaf_of(r.key); });
      if (row == rows.end()) return complain(no_such_key(rows, rows[0], key)), false;
      good = assign_part(*row, target, value) && good;
    }
    return good;
  }

  void apply_axis(const std::string& text) {
    const auto parts = text::split(text, ':');
    if (!parts) return complain("must be ID:KEY=VALUE..., such as 16:inertia_kgcm2=10 friction_mnm=50");
    config::NodeConfig* const node = addressed(parts->first);
    config::AxisConfig axis =
        node != nullptr ? node->axis.value_or(config::AxisConfig()) : config::AxisConfig();
    if (node != nullptr && assign_words(config::axis_settings(), text::words_of(parts->second), axis))
      node->axis = axis;
  }

  /// FROM=TO as if they were keys too.
  void apply_wire(const std::string& text) {
    const auto words = text::words_of(text);
    const auto ends = words.empty() ? std::nullopt : text::split(words.front(), '=');
    if (!ends) return complain("must be FROM=TO KEY=VALUE..., such as 66:output:1=5:0x2001 scale=100");
    config::WireConfig wire;
    wire.place = where_;
    const auto rows = config::wire_settings();
    bool good = assign_part(rows[0], wire, ends->first);
    good = assign_part(rows[1], wire, ends->second) && good;
    good = assign_words(rows, std::span(words).subspan(1), wire) && good;
    if (good) config_.wires.push_back(std::move(wire));
  }

  /// The node that an argument begins with; null after a complaint.
  config::NodeConfig* addressed(std::string_view id) {
    config::NodeConfig wanted;
    if (!assign_part(config::setting_of(config::node_settings(), "node.id"), wanted, id)) return nullptr;
    config::NodeConfig* node = find(wanted.id);
    if (node == nullptr) complain(fmt::format("there is no node {0}; add --node {0}=FILE.eds", id));
    return node;
  }

  config::NodeConfig* find(std::uint8_t id) {
    const auto node = std::ranges::find(network_->nodes, id, &config::NodeConfig::id);
    return node == network_->nodes.end() ? nullptr : &*node;
  }

  const Arguments& arguments_;
  config::Config& config_;
  config::NetworkConfig* network_ = &config_.networks.front();  ///< that the argument is about
  config::Place where_;                                         ///< the argument
  config::Diagnostics found_;
};

}  // namespace

std::span<const Row> option_rows() {
  return kRows;
}

std::string_view option_name(std::string_view option) {
  option.remove_prefix(option.find("--"));
  return option.substr(0, option.find(' '));
}

std::string_view option_argument(std::string_view option) {
  option.remove_prefix(option.find("--"));
  const auto parts = text::split(option, ' ');
  return parts ? parts->second : std::string_view();
}

std::vector<std::string_view> all_options() {
  std::vector<std::string_view> options;
  const auto add = [&options](const Row& row) {
    if (std::ranges::count(options, option_name(row.option), option_name) == 0) options.push_back(row.option);
  };
  config::for_each_setting(add);
  std::ranges::for_each(kRows, add);
  return options;
}

std::string no_such_option(std::string_view word, std::vector<std::string_view> options) {
  std::ranges::transform(options, options.begin(), option_name);
  return "no such option" + text::did_you_mean(word, options);
}

std::size_t network_number(std::string_view text) {
  const auto number = text::parse_integer(text);
  return number && *number >= 1 && *number <= std::int64_t{config::kMostNetworks}
             ? static_cast<std::size_t>(*number)
             : 0;
}

bool is_about_whole_plant(std::string_view option) {
  return has_option(config::settings(), option);
}

bool is_repeatable(std::string_view option) {
  return !has_option(config::settings(), option) && !has_option(config::network_settings(), option);
}

config::Diagnostics apply_options(const Arguments& arguments, config::Config& config) {
  return Options(arguments, config).apply();
}

}  // namespace cbcan::cli

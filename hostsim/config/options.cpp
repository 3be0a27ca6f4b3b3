// SPDX-License-Identifier: MIT
#include "config/options.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <utility>

#include "base/address.hpp"
#include "base/text.hpp"
#include "config/plant_file.hpp"
#include "config/plant_settings.hpp"
#include "devices/devices.hpp"

namespace cbcan::config {
namespace {

using base::Problem;
using base::Row;
using base::Setting;

// clang-format off
constexpr auto kRows = std::to_array<Row>({
    {.key = "plant.demo", .option = kDemoOption,
     .help = "The built-in plant: an I/O module (node 42h = 66), two pressure transducers (1, 2), a drive (10h = 16), "
             "a generic node (20h = 32)"},
    {.key = "plant.config", .option = "--config FILE", .help = "A plant file in TOML; docs/reference/plant-file.md explains it"},
    {.key = "plant.set", .option = "--set PATH=VALUE",
     .help = "Any key of a plant file, by its path: --set module.node_id=5, --set node.66.heartbeat_ms=500, "
             "--set network.2.can.bit_rate=125000. += adds to a list, as the file writes it: "
             "--set 'node.5.objects+={index = 0x2001, value = 1}'"},
    {.key = "plant.check", .option = "--check",
     .help = "Reads plant and EDS files, reports mistakes, and ends: exit code 0 or 2"},
    {.key = "modbus.listen", .option = "--modbus HOST:PORT",
     .help = "Where Modbus TCP is served; port 0 is any free one (default 127.0.0.1:1502)"},
    {.key = "module.none", .option = "--no-module",
     .help = "Nodes and a bus alone, for a coprocessor that runs elsewhere: no Modbus server either"},
    {.key = "network.number", .option = "--network N",
     .help = "Following options about module, CAN, log file and nodes apply to network N, earlier ones to network 1; "
             "the Modbus unit ID selects the network",
     .form = base::Form::kInteger, .low = 1, .high = std::int64_t{kMostNetworks}},
    {.key = "node.eds", .option = "--node ID=FILE",
     .help = "A node, and its device description: an EDS or DCF file; one that the plant has gets this file instead"},
    {.key = "node.faults", .option = "--fault ID:KIND KEY=VALUE...",
     .help = "A fault of a node, or of the bus or the PLC with bus or plc for ID; one argument: --fault \"5:response-late delay_ms=50 "
             "count=1\"; docs/reference/faults.md lists kinds and keys"},
    {.key = "node.wire", .option = "--wire FROM=TO KEY=VALUE...",
     .help = "Connects an output or object to an input; one argument: --wire \"66:output:1=5:0x2001 scale=100\""},
});
// clang-format on
constexpr auto kSearch = search_rows<SearchConfig>();

class Options {
 public:
  Options(const Arguments& arguments, Config& config, SearchConfig& search)
      : arguments_(arguments), config_(config), search_(search) {}

  /// Nodes first: options before --node may refer to them.
  Diagnostics apply() {
    make_networks();
    for (const Argument& argument : arguments_)
      if (is_about(argument) && argument.option == "--node") apply_node(argument.text);
    for (const Argument& argument : arguments_)
      if (is_about(argument)) apply_one(argument);
    return std::move(found_);
  }

 private:
  /// The networks may have been typed in any order.
  void make_networks() {
    std::map<std::size_t, Place> places;
    for (const Argument& argument : arguments_) {
      if (argument.option != kNetworkOption) continue;
      where_ = at(argument);
      if (argument.network == 0) {
        complain(fmt::format("must be 1..{}", kMostNetworks));
      } else {
        places.emplace(argument.network, where_);
      }
    }
    for (const auto& [number, where] : places) {
      where_ = where;
      const std::size_t next = config_.networks.size() + 1;
      if (number > next) complain(fmt::format("there is no network {}; networks have no gaps", next));
      if (number != next) continue;
      NetworkConfig& made = config_.networks.emplace_back();
      made.number = number;
      made.place = where;
      network_ = &config_.networks.front();
    }
  }

  /// False for options of a network that does not exist, which has been reported.
  bool is_about(const Argument& argument) {
    if (argument.network == 0 || argument.network > config_.networks.size()) return false;
    network_ = &config_.networks[argument.network - 1];
    where_ = at(argument);
    return true;
  }

  void apply_one(const Argument& argument) {
    if (argument.option == "--set") return apply_set(argument.text);
    if (argument.option == "--fault") return apply_fault(argument.text);
    if (argument.option == "--wire") return apply_wire(argument.text);
    if (argument.option == "--modbus") return apply_modbus(argument.text);
    if (argument.option == "--no-module") network_->module.enabled = false;
    apply_row(kNetworkSettings, *network_, argument);
    apply_row(kPlantSettings, config_, argument);
    apply_row(kSearchSettings, search_, argument);
  }

  static Place at(const Argument& argument) {
    return {fmt::format("{}{}{}", argument.option, argument.text.empty() ? "" : " ", argument.text)};
  }

  void complain(const std::string& message) {
    found_.push_back({where_, in_network(network_->number) + message});
  }

  template <class Target>
  void apply_row(std::span<const Setting<Target>> rows, Target& target, const Argument& argument) {
    for (const auto& row : rows) {
      if (base::option_name(row.option) != argument.option) continue;
      const base::Value value = base::value_of(row, argument);
      if (const Problem problem = assign(row, target, value, where_); !problem.empty())
        complain(problem);
    }
  }

  void apply_set(std::string_view text) {
    std::ranges::move(change_plant(text, where_, config_, *network_), std::back_inserter(found_));
  }

  void apply_texts(std::string_view table, std::span<const TextKey> keys) {
    std::ranges::move(change_plant(table, keys, where_, config_, *network_),
                      std::back_inserter(found_));
  }

  void apply_modbus(std::string_view text) {
    const auto parse = [&] { config_.modbus = base::parse_listen_address(text, config_.modbus.port); };
    if (const Problem problem = base::problem_of(parse); !problem.empty()) complain(problem);
  }

  /// A node of the plant file gets another EDS file.
  void apply_node(std::string_view text) {
    const auto sides = base::split(text, '=');
    if (!sides) return complain("must be ID=FILE, such as 5=io_module.eds");
    const NodeConfig* const known = find_node(*network_, sides->first);
    const std::array keys{
        TextKey("id", sides->first),
        TextKey(devices::is_script(sides->second) ? "device" : "eds", sides->second)};
    if (known != nullptr && known->place.line != 0)
      apply_texts(fmt::format("node.{}", sides->first), std::span(keys).last(1));
    else
      apply_texts("node+", keys);
  }

  /// Adds to the faults of the plant file.
  void apply_fault(std::string_view text) {
    const auto parts = base::split(text, ':');
    if (!parts)
      return complain(
          "must be ID:KIND KEY=VALUE..., bus:KIND ... or plc:KIND ..., such as 5:response-late "
          "delay_ms=50");
    const auto list = faults_at(*network_, parts->first);
    if (!list) return complain(fmt::format("there is no node {0}; add --node {0}=FILE.eds", parts->first));
    const sim::FaultOrProblem made = sim::parse_fault(parts->second, list->place);
    if (!made.problem.empty()) return complain(made.problem);
    list->faults->push_back({made.fault, where_});
  }

  /// FROM=TO becomes two keys.
  void apply_wire(std::string_view text) {
    const auto words = base::words_of(text);
    const auto ends = words.empty() ? std::nullopt : base::split(words.front(), '=');
    if (!ends) return complain("must be FROM=TO KEY=VALUE..., such as 66:output:1=5:0x2001 scale=100");
    std::vector<TextKey> keys{{"from", ends->first}, {"to", ends->second}};
    for (const std::string_view word : std::span(words).subspan(1))
      keys.push_back(base::split(word, '=').value_or(TextKey(word, {})));
    apply_texts("wire+", keys);
  }

  const Arguments& arguments_;
  Config& config_;
  SearchConfig& search_;
  NetworkConfig* network_ = &config_.networks.front();  ///< of the current argument
  Place where_;                                         ///< the current argument
  Diagnostics found_;
};

}  // namespace

const std::span<const Row> kOptionRows = kRows;
const std::span<const Setting<SearchConfig>> kSearchSettings = kSearch;

std::vector<std::string_view> all_options() {
  std::vector<std::string_view> options;
  const auto add = [&options](const Row& row) {
    if (!row.option.empty()) options.push_back(row.option);
  };
  for_each_setting(add);
  std::ranges::for_each(kSearchSettings, add);
  std::ranges::for_each(kRows, add);
  std::ranges::for_each(base::kHelpRows, add);
  return options;
}

Diagnostics apply_options(const Arguments& arguments, Config& config, SearchConfig& search) {
  return Options(arguments, config, search).apply();
}

}  // namespace cbcan::config

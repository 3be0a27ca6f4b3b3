// SPDX-License-Identifier: MIT
#include "config/command_line.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include "base/address.hpp"
#include "base/text.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/version.hpp"
#include "config/plant_file.hpp"
#include "config/plant_settings.hpp"
#include "devices/devices.hpp"

namespace cbcan::config {

namespace {

constexpr std::string_view kConfigOption = "--config";
constexpr std::string_view kDemoOption = "--demo";
constexpr std::string_view kCheckOption = "--check";
/// The options after it apply to another network.
constexpr std::string_view kNetworkOption = "--network";

struct Argument : base::Argument {
  std::size_t network = 1;  ///< that it applies to; 1 for one of the whole plant, 0 = no number of a network
};
using Arguments = std::vector<Argument>;

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

  /// Returns all mistakes; a wrong option changes nothing. Nodes first: options before --node may refer to
  /// them.
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
      if (const Problem problem = assign(row, target, value, where_); !problem.empty()) complain(problem);
    }
  }

  void apply_set(std::string_view text) {
    std::ranges::move(change_plant(text, where_, config_, *network_), std::back_inserter(found_));
  }

  void apply_texts(std::string_view table, std::span<const TextKey> keys) {
    std::ranges::move(change_plant(table, keys, where_, config_, *network_), std::back_inserter(found_));
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
    const std::array keys{TextKey("id", sides->first),
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

constexpr std::string_view kCommand = "--";

/// Options of the search that a COMMAND can have without --explore.
constexpr std::array<std::string_view, 3> kWithoutExplore{"--seeds", "--jobs", "--only"};
constexpr std::array<std::string_view, 2> kSubcommands{"run", "eds"};

std::string lost_word(std::string_view word) {
  if (word.ends_with(".toml"))
    return fmt::format("a plant file is given with --config {0}, a scenario with cbcan-sim run {0}", word);
  if (word.ends_with(".lua") || word.ends_with(".eds") || word.ends_with(".dcf"))
    return fmt::format("belongs to no option; --node 5={} is a node made from it", word);
  if (const std::string_view meant = base::nearest(word, kSubcommands); !meant.empty())
    return fmt::format("belongs to no option; did you mean cbcan-sim {} ...?", meant);
  return "belongs to no option; a COMMAND is after --, scenarios are after cbcan-sim run";
}

/// The message, or for --heartbeat "no such option; did you mean --set node.ID.heartbeat_ms=...?"
std::string about(const base::WrongWord& wrong) {
  std::string name(wrong.word.substr(0, wrong.word.find('=')));
  std::ranges::replace(name, '-', '_');
  std::string found;
  for_each_setting([&](const base::Row& row) {
    const bool is_it =
        row.option.empty() && name.size() > 3 && base::leaf_of(row.key).starts_with(name.substr(2));
    if (is_it && found.empty()) found = row.key;
  });
  if (found.empty() || !wrong.message.starts_with("no such")) return wrong.message;
  if (found.starts_with("node.")) found.insert(5, "ID.");
  return fmt::format("no such option; did you mean --set {}=...?", found);
}

/// The number in an argument of kNetworkOption; 0 = not the number of a network.
std::size_t network_number(std::string_view text) {
  const std::int64_t number = base::parse_integer(text).value_or(0);
  return number >= 1 && number <= std::int64_t{kMostNetworks} ? static_cast<std::size_t>(number) : 0;
}

bool is_about_whole_plant(std::string_view option) {
  const auto is_it = [option](const base::Row& row) { return base::option_name(row.option) == option; };
  return option == "--modbus" || std::ranges::any_of(kPlantSettings, is_it) ||
         std::ranges::any_of(kSearchSettings, is_it);
}

bool is_repeatable(std::string_view option) {
  constexpr std::array<std::string_view, 5> kRepeatable{"--set", "--node", "--fault", "--wire",
                                                        kNetworkOption};
  return std::ranges::find(kRepeatable, option) != kRepeatable.end();
}

/// Arguments, each with the network that it applies to.
class ParsedArguments {
 public:
  explicit ParsedArguments(std::span<const char* const> words) {
    base::ParsedArguments parsed = base::parse_arguments(words, all_options());
    for (const base::WrongWord& wrong : parsed.wrong)
      complain(wrong.word, about(wrong));
    if (!parsed.words.empty()) complain(parsed.words.front(), lost_word(parsed.words.front()));
    for (const base::Argument& argument : parsed.options)
      add({argument});
    command = std::move(parsed.command);
    if (parsed.has_command && command.empty())
      complain(kCommand, "write a command after it, such as -- ./run-tests");
  }

  Arguments arguments;  ///< in order
  std::vector<std::string> command;
  Diagnostics problems;

  std::size_t count(std::string_view option) const {
    return static_cast<std::size_t>(std::ranges::count(arguments, option, &Argument::option));
  }
  /// The argument --demo or --config; null = neither.
  const Argument* plant() const {
    const auto found = std::ranges::find_if(arguments, is_plant);
    return found == arguments.end() ? nullptr : &*found;
  }
  /// Whether it is set by its option or by --set.
  bool is_named(std::string_view option, std::string_view key, std::size_t network = 1) const {
    const std::string path = fmt::format("{}=", key);
    const std::string long_path = fmt::format("network.{}.{}", network, path);
    return std::ranges::any_of(arguments, [&](const Argument& argument) {
      const bool is_about = argument.network == network;
      if (argument.option != "--set") return is_about && argument.option == option;
      return argument.text.starts_with(long_path) || (is_about && argument.text.starts_with(path));
    });
  }

 private:
  void complain(std::string_view word, std::string message) {
    problems.push_back(about_option(word, std::move(message)));
  }

  void add(Argument argument) {
    if (argument.option == kNetworkOption) network_ = network_number(argument.text);
    if (!is_about_whole_plant(argument.option)) argument.network = network_;
    if (std::string problem = problem_with(argument); !problem.empty())
      complain(argument.option, std::move(problem));
    arguments.push_back(std::move(argument));
  }

  static bool is_plant(const Argument& argument) {
    return argument.option == kDemoOption || argument.option == kConfigOption;
  }

  /// Checks an argument against those before it.
  std::string problem_with(const Argument& argument) const {
    const auto same = [&](const Argument& other) {
      return other.option == argument.option && other.network == argument.network;
    };
    if (is_plant(argument) && plant() != nullptr)
      return "there can be only one plant; leave out the other --config, or --demo";
    if (!is_repeatable(argument.option) && std::ranges::any_of(arguments, same))
      return in_network(argument.network) + "is given twice";
    return {};
  }

  std::size_t network_ = 1;
};

Diagnostics read_plant_of(const Argument& plant, const base::FileReader& read, Start& start) {
  const std::string path(plant.option == kDemoOption ? kDemoPlant : plant.text);
  const std::string option = fmt::format("{} {}", kConfigOption, path);
  const auto text = read(path);
  if (!text) return {about_option(option, "this file cannot be read; check the path and its permissions")};
  if (std::string other = base::other_kind(path, *text, base::kPlantFile); !other.empty())
    return {about_option(option, std::move(other))};
  start.plant_text = *text;
  return read_plant(*text, path, start.config, {}, &read);
}

/// Registers of the PLC that FATEK FBs controllers reserve (FBs-PLC User's Manual, memory allocation): R4047
/// = 0 turns Modbus RTU off at ports 1 to 4.
constexpr unsigned kReservedFirst = 3840;
constexpr unsigned kReservedLast = 4167;

std::string remarks_on_plc(const PlcConfig& plc, std::string_view opening) {
  if (plc.address.empty() && plc.line.device.empty()) return {};
  struct Range {
    std::string_view key;
    std::optional<std::uint16_t> first;
    unsigned words, free;
  };
  const bool is_window = plc.layout == PlcLayout::kWindow;
  const unsigned words =
      is_window ? regmap::kWindowWords : regmap::kScannerOutWords + regmap::kScannerInWords;
  std::string text;
  for (const Range& range : {Range{"plc.first", plc.first, words, is_window ? 3700u : 500u},
                             Range{"plc.process_first", plc.process_first, regmap::kProcessWords, 3300},
                             Range{"plc.status_first", plc.status_first, regmap::kStatusWords, 3500}})
    if (range.first && *range.first <= kReservedLast && *range.first + range.words > kReservedFirst)
      text += fmt::format(
          "{}{}: R{}..R{} would lie over R{}..R{}, which a FATEK FBs controller reserves; there set {}\n",
          opening, range.key, *range.first, *range.first + range.words - 1, kReservedFirst, kReservedLast,
          range.free);
  return text;
}

std::string remarks_on(const NetworkConfig& network) {
  const std::string opening = "cbcan-sim: " + in_network(network.number);
  const CanConfig& can = network.can;
  std::string text = remarks_on_plc(network.plc, opening);
  if (can.outside.empty() && network.nodes.empty() && can.slcan.empty() && can.socketcand.empty()) {
    const bool first = network.number == 1;
    text += fmt::format("{}no other node is on the virtual bus; {}add a node: {}--node 5=FILE.eds\n", opening,
                        first ? "try --demo, or " : "",
                        first ? "" : fmt::format("--network {} ", network.number));
  }
  if (!can.outside.empty() && can.bit_rate != 0)
    text += fmt::format(
        "{}can.bit_rate (--bit-rate) is for the virtual bus; {} has the one that it was set up with\n",
        opening, can_spec(can));
  return text;
}

/// The environment of a command has the addresses, so any number of commands can run at a time. Addresses
/// from options stay.
void use_free_addresses(const ParsedArguments& typed, Config& config) {
  constexpr std::string_view kFree = "127.0.0.1:0";
  if (!typed.is_named("--modbus", "modbus.port")) config.modbus.port = 0;
  if (!typed.is_named("--control", "control.listen")) config.control = kFree;
  if (!typed.is_named("--http", "http.listen") && !config.http.listen.empty()) config.http.listen = kFree;
  if (!typed.is_named("", "rtu.listen") && !config.rtu.listen.empty()) config.rtu.listen = kFree;
  for (NetworkConfig& network : config.networks) {
    CanConfig& can = network.can;
    if (!typed.is_named("--slcan", "can.slcan", network.number)) can.slcan = can.outside.empty() ? kFree : "";
    if (!typed.is_named("--socketcand", "can.socketcand", network.number) && !can.socketcand.empty())
      can.socketcand = kFree;
  }
}

Start refuse(Diagnostics problems) {
  Start start;
  start.exit_code = ExitCode::kUsage;
  sort_by_place(problems);
  for (const Diagnostic& problem : problems) {
    start.err += (problem.place.line == 0 ? "cbcan-sim: " : "") + to_string(problem) + "\n";
  }
  if (problems.back().place.line == 0) start.err += "cbcan-sim --help shows all options\n";
  return start;
}

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

Start parse_command_line(int argc, const char* const* argv, const base::FileReader& read) {
  ParsedArguments typed(std::span(argv + 1, argv + argc));
  if (typed.count(base::kHelpOption) != 0) return {.out = help_text()};
  if (typed.count(base::kShortHelpOption) != 0) return {.out = short_help_text()};
  if (typed.count(base::kVersionOption) != 0) return {.out = fmt::format("cbcan-sim {}\n", kVersion)};
  if (!typed.problems.empty()) return refuse(std::move(typed.problems));

  Start start;
  Diagnostics problems;
  if (const Argument* const plant = typed.plant()) {
    problems = read_plant_of(*plant, read, start);
    start.plant_file = plant->option == kDemoOption ? kDemo : plant->text;
  }
  Diagnostics of_options = Options(typed.arguments, start.config, start.search).apply();
  // After mistakes in the plant file, nodes that options refer to may be missing.
  if (problems.empty()) problems = std::move(of_options);
  for (const auto& row : kSearchSettings) {
    const std::string_view option = base::option_name(row.option);
    if (typed.count(option) == 0) continue;
    if (typed.command.empty())
      problems.push_back(about_option(option, "is for a COMMAND: write -- and the command after it"));
    else if (!start.search.explore && std::ranges::find(kWithoutExplore, option) == kWithoutExplore.end())
      problems.push_back(about_option(option, std::string(kAddExplore)));
  }
  if (start.search.explore || !start.search.seeds.empty()) start.config.clock = ClockKind::kManual;
  if (!typed.command.empty()) use_free_addresses(typed, start.config);
  std::ranges::move(check(start.config), std::back_inserter(problems));
  if (!problems.empty()) return refuse(std::move(problems));

  for (const Argument& argument : typed.arguments)
    if (std::ranges::none_of(kSearchSettings, [&](const auto& row) {
          return base::option_name(row.option) == argument.option;
        }))
      start.words.push_back(fmt::format("{} {}", argument.option, argument.text));
  start.run = true;
  start.check = typed.count(kCheckOption) != 0;
  start.command = typed.command;
  for (const NetworkConfig& network : start.config.networks)
    start.err += remarks_on(network);
  return start;
}

}  // namespace cbcan::config

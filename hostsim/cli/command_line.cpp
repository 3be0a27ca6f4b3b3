// SPDX-License-Identifier: MIT
#include "cli/command_line.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "cbcan/version.hpp"
#include "cli/options.hpp"
#include "config/demo_plant.hpp"
#include "config/plant_file.hpp"
#include "text/words.hpp"

namespace cbcan::cli {
namespace {

constexpr std::string_view kTrue = "true";
constexpr std::string_view kCommand = "--";
constexpr std::string_view kDemo = "demo";
constexpr std::string_view kEdsAsPlant =
    "this is an EDS or DCF file, not a plant file; --node 5=FILE is a node made from it";

/// As --help shows it; empty = there is none of this name.
std::string_view find_option(std::string_view word) {
  for (const std::string_view shown : all_options()) {
    const bool is_short = shown.starts_with(word) && shown.substr(word.size()).starts_with(", ");
    if (is_short || option_name(shown) == word) return shown;
  }
  return {};
}

std::string lost_word(std::string_view word) {
  return word.ends_with(".toml") ? fmt::format("a plant file is given with --config {}", word)
                                 : "belongs to no option";
}

/// The command line taken apart. All arguments are texts to it, so that a wrong value is told the same way as
/// in a plant file.
class Typed {
 public:
  explicit Typed(std::span<const char* const> words) : words_(words) {
    while (!words_.empty() && words_.front() != kCommand)
      take_word(take());
    if (words_.empty()) return;
    command.assign(words_.begin() + 1, words_.end());
    if (command.empty()) complain(kCommand, "write a command after it, such as -- ./run-tests");
  }

  Arguments arguments;  ///< in order
  std::vector<std::string> command;
  config::Diagnostics problems;

  std::size_t count(std::string_view option) const {
    return static_cast<std::size_t>(std::ranges::count(arguments, option, &Argument::option));
  }

 private:
  std::string_view take() { return std::exchange(words_, words_.subspan(1)).front(); }

  bool has_argument() const {
    const std::string_view word = words_.empty() ? "--" : words_.front();
    return !word.starts_with("--") && find_option(word).empty();
  }

  void complain(std::string_view word, std::string message) {
    problems.push_back(config::about_option(word, std::move(message)));
  }

  void take_word(std::string_view word) {
    if (!word.starts_with('-')) return complain(word, lost_word(word));
    const auto joined = text::split(word, '=');
    const std::string_view name = joined ? joined->first : word;
    const std::string_view shown = find_option(name);
    if (shown.empty()) complain(word, no_such_option(name, all_options()));
    const bool is_flag = !shown.empty() && option_argument(shown).empty();
    const bool takes_next = !joined && !is_flag && has_argument();
    const std::string_view text = joined ? joined->second : takes_next ? take() : is_flag ? kTrue : "";
    if (shown.empty()) return;
    if (!joined && !is_flag && !takes_next) return complain(name, "needs an argument");
    add({option_name(shown), std::string(text)});
  }

  void add(Argument argument) {
    if (argument.option == kNetworkOption) network_ = network_number(argument.text);
    if (!is_about_whole_plant(argument.option)) argument.network = network_;
    if (std::string problem = problem_with(argument); !problem.empty())
      complain(argument.option, std::move(problem));
    arguments.push_back(std::move(argument));
  }

  /// Behind the ones before it.
  std::string problem_with(const Argument& argument) const {
    const auto same = [&](const Argument& other) {
      return other.option == argument.option && other.network == argument.network;
    };
    if (!is_repeatable(argument.option) && std::ranges::any_of(arguments, same))
      return config::in_network(argument.network) + "is given twice";
    const bool is_plant = argument.option == kDemoOption || argument.option == kConfigOption;
    if (is_plant && count(kDemoOption) + count(kConfigOption) != 0)
      return "there can be only one plant; leave out the other --config, or --demo";
    return argument.option == kDemoOption && argument.text != kTrue ? "takes no argument" : "";
  }

  std::span<const char* const> words_;
  std::size_t network_ = 1;
};

/// CiA 306 begins such a file with this section.
bool is_eds(std::string_view text) {
  constexpr std::string_view kSection = "[FileInfo]";
  while (!text.empty())
    if (text::same_text(text::trim(text::take_line(text)), kSection)) return true;
  return false;
}

config::Diagnostics read_plant_of(const Typed& typed, const config::FileReader& read,
                                  config::Config& config) {
  for (const Argument& argument : typed.arguments) {
    if (argument.option != kDemoOption && argument.option != kConfigOption) continue;
    const std::string path = argument.option == kDemoOption ? std::string(config::kDemoPlant) : argument.text;
    if (const auto text = read(path)) {
      if (is_eds(*text))
        return {config::about_option(fmt::format("{} {}", kConfigOption, path), std::string(kEdsAsPlant))};
      return config::read_plant(*text, path, config);
    }
    std::error_code error;
    return {config::about_option(fmt::format("{} {}", kConfigOption, path),
                                 std::filesystem::is_directory(path, error)
                                     ? "this is a folder; name the plant file in it"
                                     : "this file cannot be read; check the path and its permissions")};
  }
  return {};
}

std::string remarks_on(const config::NetworkConfig& network) {
  const std::string opening = "cbcan-sim: " + config::in_network(network.number);
  const config::CanConfig& can = network.can;
  std::string text;
  if (can.outside.empty() && network.nodes.empty() && can.slcan.empty() && can.socketcand.empty()) {
    const bool first = network.number == 1;
    text += fmt::format("{}no other node is on the virtual bus; {}add a node: {}--node 5=FILE.eds\n", opening,
                        first ? "try --demo, or " : "",
                        first ? "" : fmt::format("--network {} ", network.number));
  }
  if (!can.outside.empty() && can.bit_rate != 0)
    text += fmt::format(
        "{}can.bit_rate (--bit-rate) is for the virtual bus; {} has the one that it was set up with\n",
        opening, config::can_spec(can));
  return text;
}

/// A command is told where the plant is: so any number of them can run at once. What options name stays.
void use_free_addresses(const Typed& typed, config::Config& config) {
  constexpr std::string_view kFree = "127.0.0.1:0";
  if (typed.count("--modbus") == 0) config.modbus.port = 0;
  if (typed.count("--control") == 0) config.control = kFree;
  if (typed.count("--http") == 0 && !config.http.listen.empty()) config.http.listen = kFree;
  if (typed.count("--rtu-tcp") == 0 && !config.rtu.listen.empty()) config.rtu.listen = kFree;
  for (config::NetworkConfig& network : config.networks) {
    const auto is_named = [&](std::string_view option) {
      return std::ranges::any_of(typed.arguments, [&](const Argument& argument) {
        return argument.option == option && argument.network == network.number;
      });
    };
    if (!is_named("--slcan")) network.can.slcan = network.can.outside.empty() ? kFree : "";
    if (!is_named("--socketcand") && !network.can.socketcand.empty()) network.can.socketcand = kFree;
  }
}

Start refuse(config::Diagnostics problems) {
  Start start;
  start.exit_code = ExitCode::kUsage;
  config::sort_by_place(problems);
  for (const config::Diagnostic& problem : problems) {
    start.err += (problem.place.line == 0 ? "cbcan-sim: " : "") + config::to_string(problem) + "\n";
  }
  if (problems.back().place.line == 0) start.err += "cbcan-sim --help shows all options\n";
  return start;
}

Start print(std::string text) {
  Start start;
  start.out = std::move(text);
  return start;
}

}  // namespace

Start parse_command_line(int argc, const char* const* argv, const config::FileReader& read) {
  Typed typed(std::span(argv + 1, argv + argc));
  if (typed.count(kHelpOption) != 0) return print(help_text());
  if (typed.count(kVersionOption) != 0) return print(fmt::format("cbcan-sim {}\n", kVersion));
  if (!typed.problems.empty()) return refuse(std::move(typed.problems));

  Start start;
  config::Diagnostics problems = read_plant_of(typed, read, start.config);
  config::Diagnostics of_options = apply_options(typed.arguments, start.config);
  // Of a plant with mistakes, nodes may be missing that options are about.
  if (problems.empty()) problems = std::move(of_options);
  if (!typed.command.empty()) use_free_addresses(typed, start.config);
  std::ranges::move(check(start.config), std::back_inserter(problems));
  if (!problems.empty()) return refuse(std::move(problems));

  start.run = true;
  start.check = typed.count(kCheckOption) != 0;
  start.command = typed.command;
  for (const Argument& argument : typed.arguments)
    if (argument.option == kDemoOption || argument.option == kConfigOption)
      start.plant_file = argument.option == kDemoOption ? kDemo : argument.text;
  for (const config::NetworkConfig& network : start.config.networks)
    start.err += remarks_on(network);
  return start;
}

}  // namespace cbcan::cli

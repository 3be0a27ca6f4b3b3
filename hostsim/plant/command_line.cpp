// SPDX-License-Identifier: MIT
#include "plant/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "cbcan/version.hpp"
#include "plant/demo_plant.hpp"
#include "plant/options.hpp"
#include "plant/plant_file.hpp"
#include "text/suggestion.hpp"
#include "text/words.hpp"

namespace cbcan::plant {
namespace {

constexpr std::string_view kTrue = "true";

struct Typed {
  Arguments arguments;  ///< in order
  Diagnostics problems;

  std::size_t count(std::string_view option) const {
    return static_cast<std::size_t>(std::ranges::count(arguments, option, &Argument::option));
  }
};

/// As --help shows it; empty = there is none of this name.
std::string_view find_option(std::string_view word) {
  for (const std::string_view shown : all_options()) {
    const bool is_short = shown.starts_with(word) && shown.substr(word.size()).starts_with(", ");
    if (is_short || option_name(shown) == word) return shown;
  }
  return {};
}

Diagnostic unknown_word(std::string_view word, std::string_view name) {
  if (!word.starts_with('-'))
    return about_option(word, word.ends_with(".toml")
                                  ? fmt::format("a plant file is given with --config {}", word)
                                  : "belongs to no option");
  std::vector<std::string_view> known;
  for (const std::string_view option : all_options())
    known.push_back(option_name(option));
  return about_option(word, "no such option" + text::did_you_mean(name, known));
}

/// What is wrong with an option that comes behind those of `before`; empty = nothing.
std::string problem_with(const Argument& argument, const Typed& before) {
  const auto same = [&](const Argument& other) {
    return other.option == argument.option && other.network == argument.network;
  };
  if (!is_repeatable(argument.option) && std::ranges::any_of(before.arguments, same))
    return in_network(argument.network) + "is given twice";
  const bool is_plant = argument.option == kDemoOption || argument.option == kConfigOption;
  if (is_plant && before.count(kDemoOption) + before.count(kConfigOption) != 0)
    return "there can be only one plant; leave out the other --config, or --demo";
  return argument.option == kDemoOption && argument.text != kTrue ? "takes no argument" : "";
}

/// All arguments are texts to it, so that a wrong value is told the same way as in a plant file.
Typed take_apart(std::span<const char* const> words) {
  Typed typed;
  std::size_t network = 1;
  const auto take = [&words] { return std::exchange(words, words.subspan(1)).front(); };
  while (!words.empty()) {
    const std::string_view word = take();
    const auto joined = text::split(word, '=');
    const std::string_view name = joined ? joined->first : word;
    const std::string_view shown = find_option(name);
    const bool has_next = !words.empty() && !std::string_view(words.front()).starts_with("--") &&
                          find_option(words.front()).empty();
    if (shown.empty()) {
      typed.problems.push_back(unknown_word(word, name));
      if (word.starts_with('-') && !joined && has_next) take();  // what it was given
      continue;
    }
    const bool is_flag = option_argument(shown).empty();
    if (!joined && !is_flag && !has_next) {
      typed.problems.push_back(about_option(name, "needs an argument"));
      continue;
    }
    Argument argument{option_name(shown), std::string(joined ? joined->second : is_flag ? kTrue : take())};
    if (argument.option == kNetworkOption) network = network_number(argument.text);
    if (!is_about_whole_plant(argument.option)) argument.network = network;
    if (const std::string problem = problem_with(argument, typed); !problem.empty())
      typed.problems.push_back(about_option(argument.option, problem));
    typed.arguments.push_back(std::move(argument));
  }
  return typed;
}

Diagnostics read_plant_of(const Typed& typed, const FileReader& read, Config& config) {
  for (const Argument& argument : typed.arguments) {
    if (argument.option != kDemoOption && argument.option != kConfigOption) continue;
    const std::string path = argument.option == kDemoOption ? std::string(kDemoPlant) : argument.text;
    if (const auto text = read(path)) return read_plant(*text, path, config);
    return {about_option(fmt::format("{} {}", kConfigOption, path),
                         "this file cannot be read; check the path and its permissions")};
  }
  return {};
}

std::string remarks_on(const NetworkConfig& network) {
  const std::string opening = "cbcan-sim: " + in_network(network.number);
  const CanConfig& can = network.can;
  std::string text;
  if (can.interface_name.empty() && network.nodes.empty() && can.slcan.empty()) {
    const bool first = network.number == 1;
    text += fmt::format("{}nobody else is on the virtual bus; {}add a node: {}--node 5=FILE.eds\n", opening,
                        first ? "try --demo, or " : "",
                        first ? "" : fmt::format("--network {} ", network.number));
  }
  if (!can.interface_name.empty() && can.bit_rate != 0)
    text += fmt::format(
        "{}can.bit_rate (--bit-rate) is for the virtual bus; {} has the one that it was set up with\n",
        opening, can_spec(can));
  return text;
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

Start print(std::string text) {
  Start start;
  start.out = std::move(text);
  return start;
}

}  // namespace

Start parse_command_line(int argc, const char* const* argv, const FileReader& read) {
  Typed typed = take_apart(std::span(argv + 1, argv + argc));
  if (typed.count(kHelpOption) != 0) return print(help_text());
  if (typed.count(kVersionOption) != 0) return print(fmt::format("cbcan-sim {}\n", kVersion));
  if (!typed.problems.empty()) return refuse(std::move(typed.problems));

  Start start;
  Diagnostics problems = read_plant_of(typed, read, start.config);
  Diagnostics of_options = apply_options(typed.arguments, start.config);
  // Of a plant with mistakes, nodes may be missing that options are about.
  if (problems.empty()) problems = std::move(of_options);
  std::ranges::move(check(start.config), std::back_inserter(problems));
  if (!problems.empty()) return refuse(std::move(problems));

  start.run = true;
  for (const NetworkConfig& network : start.config.networks)
    start.err += remarks_on(network);
  return start;
}

}  // namespace cbcan::plant

// SPDX-License-Identifier: MIT
#include "plant/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <iterator>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "cbcan/version.hpp"
#include "plant/demo_plant.hpp"
#include "plant/options.hpp"
#include "plant/plant_file.hpp"
#include "text/suggestion.hpp"

namespace cbcan::plant {
namespace {

/// The command line as it was typed, before anybody asks what the arguments mean.
struct Typed {
  bool help = false;
  bool version = false;
  bool demo = false;
  std::vector<std::string> config;
  Arguments settings;
  std::vector<std::string> unknown;
};

/// Options of the parser, by their names, and the texts that it found for them.
struct Option {
  const CLI::Option* option = nullptr;
  std::vector<std::string> texts;
};
using Options = std::map<std::string_view, Option>;

void add_options(CLI::App& parser, Options& options) {
  std::vector<std::string_view> all = setting_options();
  all.push_back(kNetworkOption);
  for (const std::string_view text : all) {
    const std::string_view argument = option_argument(text);
    Option& option = options[option_name(text)];
    const std::string names(text.substr(0, text.size() - argument.size()));
    option.option = argument.empty() && text != kNetworkOption
                        ? parser.add_flag(names, option.texts)
                        : parser.add_option(names, option.texts)->allow_extra_args(false);
  }
}

/// Each text with the network of the last --network before it. As no option takes more than one argument,
/// each occurrence has one text.
Arguments arguments_of(const CLI::App& parser, const Options& options) {
  std::map<const CLI::Option*, std::vector<std::size_t>> networks;
  const Option& selector = options.at(kNetworkOption);
  std::size_t network = 1;
  for (const CLI::Option* option : parser.parse_order()) {
    std::vector<std::size_t>& seen = networks[option];
    if (option == selector.option) network = network_number(selector.texts.at(seen.size()));
    seen.push_back(network);
  }
  Arguments arguments;
  for (const auto& [name, option] : options)
    for (std::vector<Argument>& found = arguments[name]; found.size() < option.texts.size();)
      found.push_back({option.texts[found.size()], networks[option.option].at(found.size())});
  return arguments;
}

/// The only function that deals with CLI11. All arguments are texts to it, so that a wrong value is told the
/// same way as in a plant file, and its own exit codes stay with it.
Diagnostics collect(int argc, const char* const* argv, Typed& typed) {
  CLI::App parser;
  parser.set_help_flag();
  parser.allow_extras();
  parser.add_flag("-h,--help", typed.help);
  parser.add_flag("--version", typed.version);
  parser.add_flag(std::string(kDemoOption), typed.demo);
  parser.add_option(std::string(kConfigOption), typed.config)->allow_extra_args(false);
  Options options;
  add_options(parser, options);
  try {
    parser.parse(argc, argv);
  } catch (const CLI::ArgumentMismatch& error) {
    const std::string what = error.what();
    return {about_option(what.substr(0, what.find(':')), "needs an argument")};
  } catch (const CLI::ParseError& error) {
    return {about_option("command line", error.what())};
  }
  typed.settings = arguments_of(parser, options);
  typed.unknown = parser.remaining();
  return {};
}

Diagnostic unknown_option(const std::string& word) {
  std::vector<std::string_view> known;
  for (const std::string_view option : setting_options())
    known.push_back(option_name(option));
  for (const text::Row& row : option_rows())
    known.push_back(option_name(row.option));
  const std::string name = word.substr(0, word.find('='));
  return about_option(word, "no such option" + text::did_you_mean(name, known));
}

Diagnostic lost_word(const std::string& word) {
  if (word.ends_with(".toml")) return about_option(word, "a plant file is given with --config " + word);
  return about_option(word, "belongs to no option");
}

Diagnostics check_unknown(const std::vector<std::string>& words) {
  Diagnostics found;
  bool behind_option = false;  // then the word is what the unknown option was given
  for (const std::string& word : words) {
    if (word == "--") continue;
    const bool option = word.starts_with('-');
    if (option) found.push_back(unknown_option(word));
    if (!option && !behind_option) found.push_back(lost_word(word));
    behind_option = option;
  }
  return found;
}

/// Once for each network, or once.
void check_once(std::string_view option, const std::vector<Argument>& arguments, Diagnostics& found) {
  if (option == kNetworkOption || is_repeatable(option)) return;
  std::set<std::size_t> networks;
  for (const Argument& argument : arguments) {
    const std::size_t network = network_of(option, argument);
    if (!networks.insert(network).second)
      return found.push_back(about_option(std::string(option), in_network(network) + "is given twice"));
  }
}

Diagnostics check_usage(const Typed& typed) {
  Diagnostics found = check_unknown(typed.unknown);
  for (const auto& [option, arguments] : typed.settings)
    check_once(option, arguments, found);
  if (typed.config.size() + (typed.demo ? 1 : 0) > 1) {
    found.push_back(
        about_option("--config", "there can be only one plant; leave out the other --config, or --demo"));
  }
  return found;
}

Diagnostics read_plant_of(const Typed& typed, const FileReader& read, Config& config) {
  if (!typed.demo && typed.config.empty()) return {};
  const std::string path = typed.demo ? std::string(kDemoPlant) : typed.config.front();
  const auto text = read(path);
  if (text) return read_plant(*text, path, config);
  return {about_option(fmt::format("{} {}", kConfigOption, path),
                       "this file cannot be read; check the path and its permissions")};
}

std::string remarks_on(const NetworkConfig& network) {
  const std::string opening = "cbcan-sim: " + in_network(network.number);
  const CanConfig& can = network.can;
  std::string text;
  if (can.kind == CanKind::kVirtual && network.nodes.empty() && can.slcan.empty()) {
    const bool first = network.number == 1;
    text += fmt::format("{}nobody else is on the virtual bus; {}add a node: {}--node 5=FILE.eds\n", opening,
                        first ? "try --demo, or " : "",
                        first ? "" : fmt::format("--network {} ", network.number));
  }
  if (can.kind == CanKind::kSocketCan && can.bit_rate != 0)
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

void append(Diagnostics& all, Diagnostics more) {
  std::move(more.begin(), more.end(), std::back_inserter(all));
}

}  // namespace

Start parse_command_line(int argc, const char* const* argv, const FileReader& read) {
  Typed typed;
  Diagnostics problems = collect(argc, argv, typed);
  if (typed.help) return print(help_text());
  if (typed.version) return print(fmt::format("cbcan-sim {}\n", kVersion));
  append(problems, check_usage(typed));
  if (!problems.empty()) return refuse(std::move(problems));

  Start start;
  problems = read_plant_of(typed, read, start.config);
  Diagnostics of_options = apply_options(typed.settings, start.config);
  // Of a plant with mistakes, nodes may be missing that options are about.
  if (problems.empty()) problems = std::move(of_options);
  append(problems, check(start.config));
  if (!problems.empty()) return refuse(std::move(problems));

  start.run = true;
  for (const NetworkConfig& network : start.config.networks)
    start.err += remarks_on(network);
  return start;
}

}  // namespace cbcan::plant

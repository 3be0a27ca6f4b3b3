// SPDX-License-Identifier: MIT
#include "app/command_line.hpp"

#include <CLI/CLI.hpp>

#include <iterator>
#include <utility>
#include <vector>

#include "app/demo_plant.hpp"
#include "app/overrides.hpp"
#include "app/plant_file.hpp"
#include "app/suggest.hpp"

namespace cbcan::app {
namespace {

constexpr std::string_view kConfig = "--config";
constexpr std::string_view kDemo = "--demo";
constexpr std::string_view kVerbose = "--verbose";

/// The command line as it was typed, before anybody asks what the arguments mean.
struct Typed {
  bool help = false;
  bool version = false;
  bool demo = false;
  std::vector<std::string> config;
  Arguments settings;
  std::vector<std::string> unknown;
};

/// The only function that deals with CLI11. All arguments are texts to it, so that a wrong value is told the
/// same way as in a plant file, and its own exit codes stay with it.
Diagnostics collect(int argc, const char* const* argv, Typed& typed) {
  CLI::App parser;
  parser.set_help_flag();
  parser.allow_extras();
  parser.add_flag("-h,--help", typed.help);
  parser.add_flag("--version", typed.version);
  parser.add_flag(std::string(kDemo), typed.demo);
  parser.add_option(std::string(kConfig), typed.config)->allow_extra_args(false);
  for (const std::string_view option : setting_options()) {
    auto& arguments = typed.settings[option];
    const std::string name = (option == kVerbose ? "-v," : "") + std::string(option);
    if (is_flag(option)) {
      parser.add_flag(name, arguments);
    } else {
      parser.add_option(name, arguments)->allow_extra_args(false);
    }
  }
  try {
    parser.parse(argc, argv);
  } catch (const CLI::ArgumentMismatch& error) {
    const std::string what = error.what();
    return {about_option(what.substr(0, what.find(':')), "needs an argument")};
  } catch (const CLI::ParseError& error) {
    return {about_option("command line", error.what())};
  }
  typed.unknown = parser.remaining();
  return {};
}

Diagnostic unknown_option(const std::string& word) {
  std::vector<std::string_view> known = setting_options();
  known.insert(known.end(), {kConfig, kDemo, "--help", "--version"});
  const std::string name = word.substr(0, word.find('='));
  return about_option(word, "no such option" + did_you_mean(name, known));
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

Diagnostics check_usage(const Typed& typed) {
  Diagnostics found = check_unknown(typed.unknown);
  for (const auto& [option, arguments] : typed.settings) {
    if (arguments.size() > 1 && !is_repeatable(option))
      found.push_back(about_option(std::string(option), "is given twice"));
  }
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
  return {about_option("--config " + path, "this file cannot be read; check the path and its permissions")};
}

std::string remarks_on(const Config& config) {
  std::string text;
  if (config.can.kind == CanKind::kVirtual && config.nodes.empty() && config.can.slcan.empty()) {
    text += "cbcan-sim: nobody else is on the virtual bus; try --demo, or add a node: --node 5=FILE.eds\n";
  }
  if (config.can.kind == CanKind::kSocketCan && config.can.bit_rate != 0) {
    text += "cbcan-sim: can.bit_rate (--bit-rate) is for the virtual bus; " + can_spec(config.can) +
            " has the one that it was set up with\n";
  }
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
  if (typed.version) return print(version_text());
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
  start.err = remarks_on(start.config);
  return start;
}

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

/// Parser for the command lines of all programs. Options are described as --help shows them: "-v, --verbose"
/// is a flag, "--seed N" takes an argument, also as "--seed=N", and "-j, --jobs N" as "-j4". Arguments are
/// not interpreted here.
///
/// Commands as rows: their words and options, how these are stored in a Target, and their help.

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/setting.hpp"

namespace cbcan::base {

/// "--verbose" of "-v, --verbose", "--seed" of "--seed N".
std::string_view option_name(std::string_view option);
/// "" and "N".
std::string_view option_argument(std::string_view option);

/// An option as it was typed.
struct Argument {
  std::string_view option;  ///< its name
  std::string_view text;    ///< empty for a flag
};

struct WrongWord {
  std::string_view word;
  std::string message;
};

/// Refers to the parsed words, which outlive it.
struct ParsedArguments {
  std::vector<Argument> options;        ///< in order
  std::vector<std::string_view> words;  ///< that belong to no option, negative numbers included
  std::vector<WrongWord> wrong;
  bool has_command = false;          ///< there is a "--"
  std::vector<std::string> command;  ///< what follows it
};

ParsedArguments parse_arguments(std::span<const char* const> words,
                                std::span<const std::string_view> options);

inline constexpr std::string_view kShortHelpOption = "-h";
inline constexpr std::string_view kHelpOption = "--help";
inline constexpr std::string_view kVersionOption = "--version";

/// The options of every program.
extern const std::span<const Row> kHelpRows;

template <class Target>
struct Command {
  std::string_view name;  ///< with the program's name: "cbcanctl read"
  std::string_view help;
  /// Words in order; `option` is the word's name. One that ends with "..." takes all remaining words.
  std::span<const Setting<Target>> words = {};
  std::span<const Setting<Target>> options = {};
  void (*run)(const Target&) = nullptr;
};

// ---- Help

/// Line in two columns: "  --unit N       Modbus unit ID: 0..247 (default 1)"
std::string line_of(const Row& row, std::string_view standard = kNone);

/// A heading and a line for each row; empty without rows.
template <class Target>
std::string section_of(std::string_view heading, std::span<const Setting<Target>> rows) {
  const Target standard{};
  std::string text = rows.empty() ? "" : fmt::format("\n{}:\n", heading);
  for (const Setting<Target>& row : rows)
    text += line_of(row, text_in(row, standard, standard));
  return text;
}

/// "cbcanctl read [OPTION...] NODE INDEX SUB"
template <class Target>
std::string usage_of(const Command<Target>& command) {
  std::string text = fmt::format("{} [OPTION...]", command.name);
  for (const Setting<Target>& word : command.words)
    text.append(" ").append(word.option);
  return text;
}

template <class Target>
std::string help_of(const Command<Target>& command) {
  return fmt::format("{}: {}\n\nUsage:  {}\n", command.name, command.help, usage_of(command)) +
         section_of("Arguments", command.words) + section_of("Options", command.options);
}

// ---- Parsed arguments

/// The arguments of a program with one command.
template <class Target>
ParsedArguments parse_arguments(std::span<const char* const> words, const Command<Target>& command) {
  std::vector<std::string_view> known{"-h, --help"};
  std::ranges::transform(command.options, std::back_inserter(known), &Row::option);
  return parse_arguments(words, known);
}

bool is_typed(const ParsedArguments& typed, std::string_view option);

/// true for a flag.
Value value_of(const Row& row, const Argument& argument);

/// Returns "--size 129: must be 1..128", or nothing.
template <class Target>
[[nodiscard]] Problem put(const Setting<Target>& row, const Argument& argument, Target& target) {
  const Problem problem = assign(row, target, value_of(row, argument));
  return problem.empty() ? "" : fmt::format("{} {}: {}", argument.option, argument.text, problem);
}

template <class Target>
[[nodiscard]] Problem put_options(const Command<Target>& command, std::span<const Setting<Target>> shared,
                                  const ParsedArguments& typed, Target& target) {
  for (const Argument& argument : typed.options) {
    const auto is_it = [&](const Row& row) { return option_name(row.option) == argument.option; };
    auto row = std::ranges::find_if(command.options, is_it);
    if (row == command.options.end()) {
      row = std::ranges::find_if(shared, is_it);
      if (row == shared.end()) return fmt::format("{}: {} has no such option", argument.option, command.name);
    }
    if (std::ranges::count(typed.options, argument.option, &Argument::option) != 1)
      return fmt::format("{} is given twice", argument.option);
    if (const Problem problem = put(*row, argument, target); !problem.empty()) return problem;
  }
  return {};
}

template <class Target>
[[nodiscard]] Problem put_words(const Command<Target>& command, std::span<const std::string_view> words,
                                Target& target) {
  for (const Setting<Target>& row : command.words) {
    if (words.empty())
      return fmt::format("{} is missing: {}; usage: {}", row.option, row.help, usage_of(command));
    const bool takes_all = row.option.ends_with("...");
    do {
      if (const Problem problem = put(row, {row.option, words.front()}, target); !problem.empty())
        return problem;
      words = words.subspan(1);
    } while (takes_all && !words.empty());
  }
  if (words.empty()) return {};
  return fmt::format("{}: one word too many; usage: {}", words.front(), usage_of(command));
}

/// All arguments of a program with one command.
template <class Target>
[[nodiscard]] Problem put_all(const Command<Target>& command, const ParsedArguments& typed, Target& target) {
  for (const WrongWord& wrong : typed.wrong)
    return fmt::format("{}: {}", wrong.word, wrong.message);
  const Problem problem = put_options<Target>(command, {}, typed, target);
  return problem.empty() ? put_words(command, typed.words, target) : problem;
}

}  // namespace cbcan::base

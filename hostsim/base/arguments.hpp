// SPDX-License-Identifier: MIT
#pragma once

/// Parser for the command lines of all programs. Options are described as --help shows them: "-v, --verbose"
/// is a flag, "--seed N" takes an argument, also as "--seed=N", and "-j, --jobs N" as "-j4". Arguments are
/// not interpreted here.

#include <span>
#include <string>
#include <string_view>
#include <vector>

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

}  // namespace cbcan::base

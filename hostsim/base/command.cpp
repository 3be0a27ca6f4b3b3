// SPDX-License-Identifier: MIT
#include "base/command.hpp"

#include <array>
#include <optional>
#include <utility>

#include "base/text.hpp"

namespace cbcan::base {

namespace {

constexpr std::string_view kCommand = "--";

/// "no such option; did you mean --seed?"
std::string no_such_option(std::string_view word, std::span<const std::string_view> options) {
  const auto names = column(options, option_name);
  if (const auto sides = split(word, ' '); sides && std::ranges::count(names, sides->first) != 0)
    return fmt::format("no such option; {} and its argument are two words", sides->first);
  return "no such option" + did_you_mean(word, names);
}

class Parser {
 public:
  Parser(std::span<const char* const> words, std::span<const std::string_view> options)
      : words_(words), options_(options) {}

  ParsedArguments parse() {
    while (!words_.empty() && words_.front() != kCommand)
      take_word(take());
    parsed_.has_command = !words_.empty();
    if (parsed_.has_command) parsed_.command.assign(words_.begin() + 1, words_.end());
    return std::move(parsed_);
  }

 private:
  std::string_view take() { return std::exchange(words_, words_.subspan(1)).front(); }

  /// Option as --help shows it; empty = no such option.
  std::string_view find(std::string_view word) const {
    const auto found = std::ranges::find_if(options_, [word](std::string_view shown) {
      const bool is_short = shown.starts_with(word) && shown.substr(word.size()).starts_with(", ");
      return is_short || option_name(shown) == word;
    });
    return found == options_.end() ? std::string_view() : *found;
  }

  bool has_argument() const {
    const std::string_view word = words_.empty() ? kCommand : std::string_view(words_.front());
    return !word.starts_with("--") && find(word).empty();
  }

  static bool is_option(std::string_view word) {
    return word.size() > 1 && word.front() == '-' && (word[1] < '0' || word[1] > '9');
  }

  /// The parts of "--seed=4" and of "-j4"; the latter is the argument of a short option.
  std::optional<std::pair<std::string_view, std::string_view>> attached(std::string_view word) const {
    const std::string_view start = word.substr(0, 2);
    const bool is_short = word.size() > 2 && word[2] != '=' && find(word).empty();
    return is_short && !option_argument(find(start)).empty() ? std::pair(start, word.substr(2))
                                                             : split(word, '=');
  }

  void take_word(std::string_view word) {
    if (!is_option(word)) return parsed_.words.push_back(word);
    const auto joined = attached(word);
    const std::string_view name = joined ? joined->first : word;
    const std::string_view shown = find(name);
    if (shown.empty()) {
      parsed_.wrong.push_back({word, no_such_option(name, options_)});
      if (!joined && has_argument()) take();
    } else if (option_argument(shown).empty()) {
      if (joined)
        parsed_.wrong.push_back({name, "takes no argument"});
      else
        parsed_.options.push_back({option_name(shown), {}});
    } else if (!joined && !has_argument()) {
      parsed_.wrong.push_back({name, fmt::format("needs an argument, {}", option_argument(shown))});
    } else {
      parsed_.options.push_back({option_name(shown), joined ? joined->second : take()});
    }
  }

  std::span<const char* const> words_;
  std::span<const std::string_view> options_;
  ParsedArguments parsed_;
};

constexpr auto kRows = std::to_array<Row>({
    {.key = "help.short", .option = kShortHelpOption, .help = "Prints the options that are used most"},
    {.key = "help.help", .option = kHelpOption, .help = "Prints this text"},
    {.key = "help.version", .option = kVersionOption, .help = "Prints the version"},
});

bool is_flag(const Row& row) {
  return row.option.starts_with('-') && option_argument(row.option).empty();
}

}  // namespace

std::string_view option_name(std::string_view option) {
  const std::size_t longest = option.find(", ");
  if (longest != option.npos) option.remove_prefix(longest + 2);
  return option.substr(0, option.find(' '));
}

std::string_view option_argument(std::string_view option) {
  option.remove_prefix(static_cast<std::size_t>(option_name(option).data() - option.data()));
  const auto parts = split(option, ' ');
  return parts ? parts->second : std::string_view();
}

ParsedArguments parse_arguments(std::span<const char* const> words,
                                std::span<const std::string_view> options) {
  return Parser(words, options).parse();
}

const std::span<const Row> kHelpRows = kRows;

std::string line_of(const Row& row, std::string_view standard) {
  constexpr std::size_t kColumn = 25;
  const bool is_any = is_text(row) && row.choices.empty() &&
                      (row.domain.empty() || row.domain == option_argument(row.option));
  const std::string domain = row.form == Form::kOfMember || is_flag(row) || is_any ? "" : domain_of(row);
  const bool has_standard = !domain.empty() && !standard.empty() && standard != kNone;
  const std::string text = fmt::format("{}{}{}{}", row.help, domain.empty() ? "" : ": ", domain,
                                       has_standard ? fmt::format(" (default {})", standard) : "");
  return beside(row.option, text, kColumn);
}

Value value_of(const Row& row, const Argument& argument) {
  return is_flag(row) ? Value(true) : typed(row, argument.text);
}

bool is_typed(const ParsedArguments& typed, std::string_view option) {
  return std::ranges::count(typed.options, option, &Argument::option) != 0;
}

}  // namespace cbcan::base

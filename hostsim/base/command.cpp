// SPDX-License-Identifier: MIT
#include "base/command.hpp"

#include <array>

#include "base/text.hpp"

namespace cbcan::base {

namespace {

constexpr auto kRows = std::to_array<Row>({
    {.key = "help.short", .option = kShortHelpOption, .help = "Prints the options that are used most"},
    {.key = "help.help", .option = kHelpOption, .help = "Prints this text"},
    {.key = "help.version", .option = kVersionOption, .help = "Prints the version"},
});

bool is_flag(const Row& row) {
  return row.option.starts_with('-') && option_argument(row.option).empty();
}

}  // namespace

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

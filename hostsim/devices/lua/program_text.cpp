// SPDX-License-Identifier: MIT
#include "devices/lua/program_text.hpp"

#include <algorithm>
#include <cstddef>
#include <string>

namespace cbcan::devices {

namespace {

/// If the text begins with the bracket of a long string: one more than its number of '='; else 0.
std::size_t long_bracket(std::string_view text) {
  if (!text.starts_with('[')) return 0;
  const std::size_t second = text.find_first_not_of('=', 1);
  return second != std::string_view::npos && text[second] == '[' ? second : 0;
}

/// Length of the comment or string at the beginning of the text; 0 = none.
std::size_t skipped(std::string_view text) {
  const bool is_comment = text.starts_with("--");
  const std::string_view inside = is_comment ? text.substr(2) : text;
  const auto up_to = [&](std::string_view end, std::size_t from) {
    const std::size_t found = text.find(end, from);
    return found == std::string_view::npos ? text.size() : found + end.size();
  };
  if (const std::size_t bracket = long_bracket(inside); bracket != 0)
    return up_to("]" + std::string(bracket - 1, '=') + "]", 0);
  if (is_comment) return std::min(text.find_first_of("\r\n"), text.size());
  if (!text.starts_with('"') && !text.starts_with('\'')) return 0;
  std::size_t end = 1;
  while (end < text.size() && text[end] != text[0])
    end += text[end] == '\\' ? 2U : 1U;
  return std::min(end + 1, text.size());
}

}  // namespace

bool has_remainder(std::string_view program) {
  while (!program.empty() && program[0] != '%')
    program.remove_prefix(std::max<std::size_t>(1, skipped(program)));
  return !program.empty();
}

bool has_zero(std::string_view program) {
  for (std::size_t at = program.find('\\'); at < program.size(); at = program.find('\\', at + 2)) {
    const std::string_view escape = program.substr(at + 1, 3);
    const std::string_view digits = escape.substr(0, escape.find_first_not_of("0123456789"));
    if (!digits.empty() && digits.find_first_not_of('0') == std::string_view::npos) return true;
    if (escape == "x00") return true;
    const std::size_t end = program.find_first_not_of('0', at + 3);
    if (escape.starts_with("u{") && end < program.size() && program[end] == '}') return true;
  }
  return program.find('\0') != std::string_view::npos;
}

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// Splitting text, and joining it for display.

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace cbcan::base {

/// Removes blanks at both ends; every control character counts as a blank (old editors end a file with 1Ah).
constexpr std::string_view trim(std::string_view text) {
  const auto is_blank = [](char c) { return static_cast<unsigned char>(c) <= ' '; };
  const char* first = text.data();
  const char* last = first + text.size();
  while (first != last && is_blank(*first))
    ++first;
  while (first != last && is_blank(last[-1]))
    --last;
  return {first, static_cast<std::size_t>(last - first)};
}

/// The parts between these characters.
std::vector<std::string_view> words_of(std::string_view text, std::string_view marks = " \t\r\n\v\f");

/// The parts left and right of the first `mark`; nullopt if there is none.
std::optional<std::pair<std::string_view, std::string_view>> split(std::string_view text, char mark);

/// Removes the part before the first `mark`, and the mark, from the front of `rest`; everything if there is none.
std::string_view take_part(std::string_view& rest, char mark);
/// Removes the first line from the front of `rest` and returns it without its end.
std::string_view take_line(std::string_view& rest);

/// Equality without regard to the case of ASCII letters.
bool same_letters(std::string_view a, std::string_view b);
inline bool same_text(std::string_view a, std::string_view b) {
  return a.size() == b.size() && same_letters(a, b);
}

/// The parts of "node.objects.sub": "node.objects" and "sub".
std::string_view table_of(std::string_view key);
std::string_view leaf_of(std::string_view key);

/// One value of each row of a table, such as its name.
template <class Rows, class Of>
auto column(const Rows& rows, Of of) {
  std::vector<std::remove_cvref_t<std::invoke_result_t<Of&, decltype(*std::begin(rows))>>> values;
  std::ranges::transform(rows, std::back_inserter(values), of);
  return values;
}

/// "a, b or c"
std::string listed(std::span<const std::string_view> words, std::string_view last = " or ");

/// Two blanks and `left`, and beside it, from `column`, the words of `right` in lines of 80 columns. If `left` is
/// too long, `right` begins on the next line.
std::string beside(std::string_view left, std::string_view right, std::size_t column);

}  // namespace cbcan::base

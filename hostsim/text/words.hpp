// SPDX-License-Identifier: MIT
#pragma once

/// Text taken apart, and put together for people.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cbcan::text {

/// Without blanks at both ends; every control character counts as a blank (old editors end a file with 1Ah).
std::string_view trim(std::string_view text);

/// What stands between blanks and line ends.
std::vector<std::string_view> words_of(std::string_view text);

/// The parts left and right of the first `mark`; nullopt where there is none.
std::optional<std::pair<std::string_view, std::string_view>> split(std::string_view text, char mark);

/// Takes what stands before the first `mark` off the front of `rest`, and the mark; all where there is none.
std::string_view take_part(std::string_view& rest, char mark);
/// Takes the first line off the front of `rest`, without its end.
std::string_view take_line(std::string_view& rest);

/// Equal but for the case of ASCII letters, and the order that goes with it.
bool same_text(std::string_view a, std::string_view b);
bool less_text(std::string_view a, std::string_view b);

/// The parts of "node.objects.sub": "node.objects" and "sub".
std::string_view table_of(std::string_view key);
std::string_view leaf_of(std::string_view key);

/// "a, b or c"
std::string listed(std::span<const std::string_view> words, std::string_view last = " or ");

/// `left` behind two blanks, and beside it, from `column` on, the words of `right` in lines of 80 columns; it
/// begins a line of its own where `left` is too long.
std::string beside(std::string_view left, std::string_view right, std::size_t column);

}  // namespace cbcan::text

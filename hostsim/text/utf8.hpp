// SPDX-License-Identifier: MIT
#pragma once

/// Text whose encoding nobody has promised: ASCII as a rule, UTF-8 or Latin-1 in the wild.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace cbcan::text {

/// Takes the next UTF-8 code point off the front of `rest`; nothing, and `rest` unchanged, if there is none.
std::optional<char32_t> take_code_point(std::string_view& rest);

bool is_utf8(std::string_view text);

/// From 1; 0 = all of it is UTF-8.
std::size_t first_line_not_utf8(std::string_view text);

/// UTF-8 stays, anything else is taken as Latin-1.
std::string as_utf8(std::string_view text);

/// Likewise, for people to read: control characters become blanks.
std::string to_utf8(std::string_view text);

/// Likewise, but for the ends of lines.
std::string lines_to_utf8(std::string_view lines);

/// At most `most` bytes of it, without a part of a character at the end.
std::string_view head(std::string_view text, std::size_t most);

}  // namespace cbcan::text

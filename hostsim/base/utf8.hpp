// SPDX-License-Identifier: MIT
#pragma once

/// Text of unknown encoding: usually ASCII, sometimes UTF-8 or Latin-1.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace cbcan::base {

/// Removes the next UTF-8 code point from the front of `rest`; nullopt, and `rest` unchanged, if there is none.
std::optional<char32_t> take_code_point(std::string_view& rest);

/// The first line that is not UTF-8, from 1; 0 = the whole text is UTF-8.
std::size_t first_line_not_utf8(std::string_view text);

/// UTF-8 stays; any other text is converted from Latin-1.
std::string as_utf8(std::string_view text);

/// The same, for display: control characters become blanks.
std::string to_utf8(std::string_view text);

/// The same, for a text or an attribute of XML 1.0.
std::string to_xml(std::string_view text);

/// The same as to_utf8(), but line ends are kept.
std::string lines_to_utf8(std::string_view lines);
void append_lines(std::string& to, std::string_view lines);

/// The first `most` bytes or fewer, without an incomplete character at the end.
std::string_view head(std::string_view text, std::size_t most);

}  // namespace cbcan::base

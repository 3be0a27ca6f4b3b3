// SPDX-License-Identifier: MIT
#pragma once

/// Small helpers for text whose encoding nobody has promised: ASCII as a rule, UTF-8 or Latin-1 in the wild.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace cbcan::eds {

/// Without blanks at both ends; every control character counts as a blank (old editors end a file with 1Ah).
std::string_view trim(std::string_view text);

/// Equal but for the case of ASCII letters.
bool same_text(std::string_view a, std::string_view b);

/// Order that goes with same_text.
bool less_text(std::string_view a, std::string_view b);

/// Takes the next UTF-8 code point off the front of `rest`; nothing, and `rest` unchanged, if there is none.
std::optional<char32_t> take_code_point(std::string_view& rest);

bool is_utf8(std::string_view text);

/// For people to read: UTF-8 stays, anything else is taken as Latin-1; control characters become blanks.
std::string to_utf8(std::string_view text);

/// At most `most` bytes of it, without a part of a character at the end.
std::string_view head(std::string_view text, std::size_t most);

/// For a message: as to_utf8, at most some forty characters.
std::string shortened(std::string_view text);

/// Likewise, in quotes.
std::string quoted(std::string_view text);

/// A section name for a message: [1018sub1].
std::string bracketed(std::string_view name);

/// As many upper-case hexadecimal digits as are asked for, or more if it takes more.
std::string hex(std::uint64_t number, unsigned digits);

}  // namespace cbcan::eds

// SPDX-License-Identifier: MIT
#pragma once

/// Text split and joined, numbers in it, its encoding, and names that are nearly right.

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
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

/// Removes the part before the first `mark`, and the mark, from the front of `rest`; everything if there is
/// none.
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

/// Two blanks and `left`, and beside it, from `column`, the words of `right` in lines of 80 columns. If
/// `left` is too long, `right` begins on the next line.
std::string beside(std::string_view left, std::string_view right, std::size_t column);

// ---- Numbers: the only place that uses std::from_chars

/// All of `text` as a number of this type, an integer in `base`; nullopt if it is none or does not fit. The
/// only sign is the minus; no prefix, no blanks.
template <class Number, class... Base>
std::optional<Number> parse(std::string_view text, Base... base) {
  Number number{};
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, number, base...);
  if (text.empty() || error != std::errc{} || stopped != end) return std::nullopt;
  return number;
}

constexpr bool has_hex_prefix(std::string_view text) {
  return text.starts_with("0x") || text.starts_with("0X");
}

/// "12", "-5", "0x1017", "1017h", "0FFh"; the text must contain nothing else.
std::optional<std::int64_t> parse_integer(std::string_view text);

/// "12.345678": seconds.
std::string seconds_text(std::uint64_t microseconds);

/// "100ms": a whole number of us, ms or s, at most a year. Returns microseconds.
std::optional<std::uint64_t> parse_duration(std::string_view text);

/// Upper-case hexadecimal digits, this many or more.
std::string hex(std::uint64_t number, unsigned digits);

/// "0A 1B": two upper-case digits for each byte.
std::string hex(std::span<const std::uint8_t> bytes, std::string_view between);

/// "3700 1 65535"
std::string joined(std::span<const std::uint16_t> numbers);

// ---- Text of unknown encoding: usually ASCII, sometimes UTF-8 or Latin-1

/// Removes the next UTF-8 code point from the front of `rest`; nullopt, and `rest` unchanged, if there is
/// none.
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

// ---- What the user may have meant by a name that does not exist

/// The known name nearest to `word`; empty if none is near. Names may have a table in front ("can.bit_rate").
/// The result is the nearest name in the same table by edit distance, or else the same name in another table.
std::string_view nearest(std::string_view word, std::span<const std::string_view> known);

/// "; did you mean can.bit_rate?", or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> known);

}  // namespace cbcan::base

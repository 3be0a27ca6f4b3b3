// SPDX-License-Identifier: MIT
#include "base/text.hpp"

#include <fmt/ranges.h>

#include "base/buffer.hpp"

namespace cbcan::base {

namespace {

constexpr std::size_t kColumns = 80;

constexpr char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

constexpr unsigned byte_of(char c) {
  return static_cast<unsigned char>(c);
}
constexpr bool is_continuation(char c) {
  return (byte_of(c) & 0xC0) == 0x80;
}

/// Bytes of the UTF-8 sequence that starts with `lead`; 0 = not a lead byte.
constexpr std::size_t sequence_length(unsigned lead) {
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return 2;
  if (lead >= 0xE0 && lead <= 0xEF) return 3;
  return lead >= 0xF0 && lead <= 0xF4 ? 4 : 0;
}

/// Overlong, surrogate or beyond Unicode.
constexpr bool is_forbidden(char32_t code, std::size_t length) {
  if (length == 3) return code < 0x800 || (code >= 0xD800 && code <= 0xDFFF);
  return length == 4 && (code < 0x10000 || code > 0x10FFFF);
}

std::string from_latin1(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (byte_of(c) < 0x80) {
      out += c;
    } else {
      out += static_cast<char>(0xC0 | byte_of(c) >> 6);
      out += static_cast<char>(0x80 | (byte_of(c) & 0x3F));
    }
  }
  return out;
}

constexpr std::size_t kLongestWord = 100;

/// The number of letters inserted, deleted, replaced, or swapped with their neighbour (Damerau and
/// Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> cost(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        cost[i][j] = i + j;
        continue;
      }
      const std::size_t replaced = cost[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      cost[i][j] = std::min({replaced, cost[i - 1][j] + 1, cost[i][j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
    }
  }
  return cost[a.size()][b.size()];
}

bool contains(std::string_view text, std::string_view part) {
  return part.size() >= 2 && text.find(part) != std::string_view::npos;
}

/// How different two names are for a person; nullopt = not similar. Names of which one contains the other
/// ("timeout", "sdo_timeout_ms") are near.
std::optional<std::size_t> distance(std::string_view a, std::string_view b) {
  constexpr std::size_t kPartOfEachOther = 2;
  const std::size_t edits = edit_distance(a, b);
  if (contains(a, b) || contains(b, a)) return std::min(edits, kPartOfEachOther);
  return edits <= std::max<std::size_t>(1, std::max(a.size(), b.size()) / 3) ? std::optional(edits)
                                                                             : std::nullopt;
}

}  // namespace

std::vector<std::string_view> words_of(std::string_view text, std::string_view marks) {
  std::vector<std::string_view> words;
  for (auto at = text.find_first_not_of(marks); at != std::string_view::npos;) {
    const auto end = std::min(text.find_first_of(marks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(marks, end);
  }
  return words;
}

std::optional<std::pair<std::string_view, std::string_view>> split(std::string_view text, char mark) {
  const auto at = text.find(mark);
  if (at == std::string_view::npos) return std::nullopt;
  return std::pair(text.substr(0, at), text.substr(at + 1));
}

std::string_view take_part(std::string_view& rest, char mark) {
  const std::string_view part = rest.substr(0, rest.find(mark));
  rest.remove_prefix(std::min(rest.size(), part.size() + 1));
  return part;
}

std::string_view take_line(std::string_view& rest) {
  return take_part(rest, '\n');
}

bool same_letters(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, {}, lower, lower);
}

std::string_view table_of(std::string_view key) {
  const auto dot = key.rfind('.');
  return dot == std::string_view::npos ? std::string_view{} : key.substr(0, dot);
}

std::string_view leaf_of(std::string_view key) {
  return key.substr(key.rfind('.') + 1);
}

std::string listed(std::span<const std::string_view> words, std::string_view last) {
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i != 0) list += i + 1 == words.size() ? last : ", ";
    list += words[i];
  }
  return list;
}

std::string beside(std::string_view left, std::string_view right, std::size_t column) {
  std::string text;
  std::string line = "  " + std::string(left);
  if (line.size() + 1 >= column) {
    text = line + "\n";
    line.clear();
  }
  line.resize(column - 1, ' ');
  for (const std::string_view word : words_of(right)) {
    if (line.size() + 1 + word.size() > kColumns) {
      text += line + "\n";
      line.assign(column - 1, ' ');
    }
    line.append(" ").append(word);
  }
  return text + line + "\n";
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
  const bool prefixed = has_hex_prefix(text);
  const bool suffixed = !prefixed && text.size() > 1 && text.front() >= '0' && text.front() <= '9' &&
                        (text.back() == 'h' || text.back() == 'H');
  if (!prefixed && !suffixed) return parse<std::int64_t>(text);
  if (prefixed)
    text.remove_prefix(2);
  else
    text.remove_suffix(1);
  return text.starts_with('-') ? std::nullopt : parse<std::int64_t>(text, 16);
}

std::string seconds_text(std::uint64_t microseconds) {
  return made([&](Buffer& to) { append(to, Seconds{microseconds}); });
}

std::optional<std::uint64_t> parse_duration(std::string_view text) {
  constexpr std::uint64_t kMost = 365ULL * 24 * 3600 * 1'000'000;
  const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  const auto count = parse<std::uint64_t>(text.substr(0, digits));
  const std::string_view unit = text.substr(digits);
  const std::uint64_t scale = unit == "us" ? 1 : unit == "ms" ? 1000 : unit == "s" ? 1'000'000 : 0;
  if (!count || scale == 0 || *count > kMost / scale) return std::nullopt;
  return *count * scale;
}

std::string hex(std::uint64_t number, unsigned digits) {
  return made([&](Buffer& to) { append(to, Hex{number, digits}); });
}

std::string hex(std::span<const std::uint8_t> bytes, std::string_view between) {
  return made([&](Buffer& to) { append(to, HexBytes{bytes, between}); });
}

std::string joined(std::span<const std::uint16_t> numbers) {
  return fmt::format("{}", fmt::join(numbers, " "));
}

std::optional<char32_t> take_code_point(std::string_view& rest) {
  if (rest.empty()) return std::nullopt;
  const unsigned lead = byte_of(rest.front());
  const std::size_t length = sequence_length(lead);
  if (length == 0 || length > rest.size()) return std::nullopt;
  char32_t code = length == 1 ? lead : lead & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if (!is_continuation(rest[i])) return std::nullopt;
    code = code << 6 | (byte_of(rest[i]) & 0x3F);
  }
  if (is_forbidden(code, length)) return std::nullopt;
  rest.remove_prefix(length);
  return code;
}

std::size_t first_line_not_utf8(std::string_view text) {
  std::size_t line = 1;
  while (const auto code = take_code_point(text))
    if (*code == '\n') ++line;
  return text.empty() ? 0 : line;
}

std::string as_utf8(std::string_view text) {
  return first_line_not_utf8(text) == 0 ? std::string(text) : from_latin1(text);
}

std::string to_utf8(std::string_view text) {
  if (std::ranges::all_of(text, [](char c) { return c >= ' ' && c < 0x7F; })) return std::string(text);
  std::string out = lines_to_utf8(text);
  std::ranges::replace(out, '\n', ' ');
  return out;
}

std::string to_xml(std::string_view text) {
  std::string result;
  for (const char c : to_utf8(text)) {
    switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      default: result += c;
    }
  }
  return result;
}

void append_lines(std::string& to, std::string_view lines) {
  if (std::ranges::all_of(lines, [](char c) { return (c >= ' ' && c < 0x7F) || c == '\n'; })) {
    to += lines;
    return;
  }
  if (first_line_not_utf8(lines) != 0) return append_lines(to, from_latin1(lines));
  while (!lines.empty()) {
    const std::string_view from = lines;
    const char32_t code = *take_code_point(lines);
    const bool is_control = (code < 0x20 && code != '\n') || (code >= 0x7F && code < 0xA0);
    to += is_control ? " " : from.substr(0, from.size() - lines.size());
  }
}

std::string lines_to_utf8(std::string_view lines) {
  std::string out;
  append_lines(out, lines);
  return out;
}

std::string_view head(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t end = most;
  while (end > 0 && most - end < 4 && is_continuation(text[end]))
    --end;
  return text.substr(0, end);
}

std::string_view nearest(std::string_view word, std::span<const std::string_view> known) {
  if (word.size() > kLongestWord) return {};
  std::string_view best;
  std::size_t best_rank = 0;  ///< at the same distance, a name that begins with the word is nearer
  for (const std::string_view name : known) {
    const auto away = distance(leaf_of(word), leaf_of(name));
    if (table_of(name) != table_of(word) || !away) continue;
    const std::size_t rank = 2 * *away + (leaf_of(name).starts_with(leaf_of(word)) ? 0 : 1);
    if (!best.empty() && rank >= best_rank) continue;
    best = name;
    best_rank = rank;
  }
  if (!best.empty()) return best;
  const auto is_same = [word](std::string_view name) { return leaf_of(name) == leaf_of(word); };
  constexpr std::ptrdiff_t kMostAlike = 2;  // a name that many tables have is no help
  const std::ptrdiff_t alike = std::ranges::count_if(known, is_same);
  return alike != 0 && alike <= kMostAlike ? *std::ranges::find_if(known, is_same) : std::string_view{};
}

std::string did_you_mean(std::string_view word, std::span<const std::string_view> known) {
  const std::string_view name = nearest(word, known);
  return name.empty() ? "" : "; did you mean " + std::string(name) + "?";
}

}  // namespace cbcan::base

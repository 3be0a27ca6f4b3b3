// SPDX-License-Identifier: MIT
#include "base/utf8.hpp"

#include <algorithm>

namespace cbcan::base {

namespace {

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

}  // namespace

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

}  // namespace cbcan::base

// SPDX-License-Identifier: MIT
#include "eds/text.hpp"

#include <algorithm>

namespace cbcan::eds {

namespace {

constexpr std::size_t kMessageBytes = 40;

constexpr unsigned byte_of(char c) {
  return static_cast<unsigned char>(c);
}
constexpr bool is_blank(char c) {
  return byte_of(c) <= 0x20;
}
constexpr bool is_continuation(char c) {
  return (byte_of(c) & 0xC0) == 0x80;
}
constexpr char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
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

void append_latin1(std::string& out, char c) {
  if (byte_of(c) < 0x80) {
    out += c;
    return;
  }
  out += static_cast<char>(0xC0 | byte_of(c) >> 6);
  out += static_cast<char>(0x80 | (byte_of(c) & 0x3F));
}

}  // namespace

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front()))
    text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back()))
    text.remove_suffix(1);
  return text;
}

bool same_text(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

bool less_text(std::string_view a, std::string_view b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(),
                                      [](char x, char y) { return lower(x) < lower(y); });
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

bool is_utf8(std::string_view text) {
  while (!text.empty())
    if (!take_code_point(text)) return false;
  return true;
}

std::string to_utf8(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  if (is_utf8(text)) {
    out = text;
  } else {
    for (const char c : text)
      append_latin1(out, c);
  }
  std::replace_if(
      out.begin(), out.end(), [](char c) { return byte_of(c) < 0x20 || byte_of(c) == 0x7F; }, ' ');
  return out;
}

std::string_view head(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t end = most;
  while (end > 0 && most - end < 4 && is_continuation(text[end]))
    --end;
  return text.substr(0, end);
}

std::string shortened(std::string_view text) {
  const std::string_view start = head(text, kMessageBytes);
  return to_utf8(start) + (start.size() < text.size() ? "..." : "");
}

std::string quoted(std::string_view text) {
  return '"' + shortened(text) + '"';
}

std::string bracketed(std::string_view name) {
  return '[' + shortened(name) + ']';
}

std::string hex(std::uint64_t number, unsigned digits) {
  std::string out;
  for (; number != 0 || out.size() < digits; number >>= 4)
    out += "0123456789ABCDEF"[number & 0xF];
  std::reverse(out.begin(), out.end());
  return out;
}

}  // namespace cbcan::eds

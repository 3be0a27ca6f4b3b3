// SPDX-License-Identifier: MIT
#pragma once

/// Text made piece by piece in memory that is used again, so that it allocates nothing.

#include <fmt/compile.h>

#include <concepts>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

namespace cbcan::base {

/// Short texts are in the object; clear() keeps the memory of longer ones.
using Buffer = fmt::basic_memory_buffer<char, 512>;

inline std::string_view view(const Buffer& buffer, std::size_t from = 0) {
  return {buffer.data() + from, buffer.size() - from};
}

inline std::string_view characters(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A number with at least this many upper-case hexadecimal digits, 16 at most.
struct Hex {
  std::uint64_t number;
  unsigned digits;
};
/// Two upper-case hexadecimal digits for each byte.
struct HexBytes {
  std::span<const std::uint8_t> bytes;
  std::string_view between = "";
};
/// A number with at least this many decimal digits.
struct Padded {
  std::uint64_t number;
  unsigned digits;
};
/// A number of units of 1/10^places, 9 at most, without zeros at its end: "1.5", "2".
struct Decimal {
  std::uint64_t number;
  unsigned places;
};
/// Microseconds as seconds with six places: "12.345678".
struct Seconds {
  std::uint64_t microseconds;
};

// The parts of append(): room() is at least what write() writes, and write() returns the end. Other
// directories have write() for their types.

constexpr std::size_t room(std::string_view text) {
  return text.size();
}
template <std::size_t kSize>
constexpr std::size_t room(const char (&)[kSize]) {
  return kSize - 1;
}
/// Enough for a number in any form.
template <class Number>
requires(!std::convertible_to<Number, std::string_view>) constexpr std::size_t
    room(const Number& /*number*/) {
  return 42;
}
constexpr std::size_t room(const HexBytes& hex) {
  return hex.bytes.size() * (2 + hex.between.size());
}

inline char* write(char* at, std::string_view text) {
  if (!text.empty()) std::memcpy(at, text.data(), text.size());
  return at + text.size();
}
template <std::size_t kSize>
char* write(char* at, const char (&literal)[kSize]) {
  std::memcpy(at, literal, kSize - 1);
  return at + kSize - 1;
}
inline char* write(char* at, char c) {
  *at = c;
  return at + 1;
}
template <std::integral Number>
requires(!std::same_as<Number, bool>) char* write(char* at, Number number) {
  if (static_cast<std::uint64_t>(number) < 10) return write(at, static_cast<char>('0' + number));
  return fmt::format_to(at, FMT_COMPILE("{}"), number);
}
/// Writes a point or an exponent, as in TOML and JSON: "2.0".
char* write(char* at, double number);
char* write(char* at, const Hex& hex);
char* write(char* at, const HexBytes& hex);
char* write(char* at, const Padded& padded);
char* write(char* at, const Decimal& decimal);
char* write(char* at, const Seconds& seconds);

/// Appends texts, characters, numbers and the above.
template <class... Parts>
void append(Buffer& to, const Parts&... parts) {
  const std::size_t size = to.size();
  to.reserve(size + (room(parts) + ...));
  char* at = to.data() + size;
  ((at = write(at, parts)), ...);
  to.resize(static_cast<std::size_t>(at - to.data()));
}

/// What `make(buffer)` appends.
template <class Make>
std::string made(Make make) {
  Buffer buffer;
  make(buffer);
  return std::string(view(buffer));
}

}  // namespace cbcan::base

// SPDX-License-Identifier: MIT
#pragma once

/// Text made piece by piece in memory that is used again, so that it allocates nothing.

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace cbcan::base {

/// Short texts are in the object; clear() keeps the memory of longer ones.
class Buffer {
 public:
  Buffer() = default;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  char* data() { return data_; }
  const char* data() const { return data_; }
  std::size_t size() const { return size_; }
  /// New characters have any value.
  void resize(std::size_t size) {
    if (size > room_) grow(size);
    size_ = size;
  }
  /// `end` is in front of its end.
  void cut(const char* end) { size_ = static_cast<std::size_t>(end - data_); }
  void clear() { size_ = 0; }

 private:
  void grow(std::size_t least);

  std::array<char, 512> short_;
  std::unique_ptr<char[]> long_;
  char* data_ = short_.data();
  std::size_t size_ = 0;
  std::size_t room_ = short_.size();
};

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
/// A number with at least this many decimal digits, 20 at most.
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
// directories have these for their types.

constexpr std::size_t room(std::string_view text) {
  return text.size();
}
inline char* write(char* at, std::string_view text) {
  if (!text.empty()) std::memcpy(at, text.data(), text.size());
  return at + text.size();
}
template <std::size_t kSize>
constexpr std::size_t room(const char (&)[kSize]) {
  return kSize - 1;
}
template <std::size_t kSize>
char* write(char* at, const char (&literal)[kSize]) {
  std::memcpy(at, literal, kSize - 1);
  return at + (kSize - 1);
}

template <std::integral Number>
constexpr std::size_t room(Number /*number*/) {
  return 20;
}
char* write_decimal(char* at, std::uint64_t number);
template <std::integral Number>
requires(!std::same_as<Number, bool>) char* write(char* at, Number number) {
  const auto raw = static_cast<std::uint64_t>(number);
  if (raw < 10) {
    *at = static_cast<char>('0' + raw);
    return at + 1;
  }
  if (std::cmp_greater(number, 0)) return write_decimal(at, raw);
  *at = '-';
  return write_decimal(at + 1, 0 - raw);
}
inline char* write(char* at, char c) {
  *at = c;
  return at + 1;
}

constexpr std::size_t room(const Hex& /*hex*/) {
  return 16;
}
char* write(char* at, const Hex& hex);
constexpr std::size_t room(const HexBytes& hex) {
  return hex.bytes.size() * (2 + hex.between.size());
}
char* write(char* at, const HexBytes& hex);
constexpr std::size_t room(const Padded& /*padded*/) {
  return 20;
}
char* write(char* at, const Padded& padded);
constexpr std::size_t room(const Decimal& /*decimal*/) {
  return 21 + 20;
}
char* write(char* at, const Decimal& decimal);
constexpr std::size_t room(const Seconds& /*seconds*/) {
  return 21 + 20;
}
char* write(char* at, const Seconds& seconds);

/// Appends texts, characters, numbers and the above.
template <class... Parts>
inline void append(Buffer& to, const Parts&... parts) {
  const std::size_t size = to.size();
  to.resize(size + (room(parts) + ...));
  char* at = to.data() + size;
  ((at = write(at, parts)), ...);
  to.cut(at);
}

/// What `make(buffer)` appends.
template <class Make>
std::string made(Make make) {
  Buffer buffer;
  make(buffer);
  return std::string(view(buffer));
}

}  // namespace cbcan::base

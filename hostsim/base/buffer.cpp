// SPDX-License-Identifier: MIT
#include "base/buffer.hpp"

#include <array>
#include <bit>

namespace cbcan::base {

namespace {

constexpr char digit_of(std::uint64_t number) {
  return "0123456789ABCDEF"[number & 0xF];
}

/// The last `count` digits.
char* write_digits(char* at, std::uint64_t number, std::size_t count) {
  for (std::size_t place = count; place-- > 0; number /= 10)
    at[place] = digit_of(number % 10);
  return at + count;
}

}  // namespace

char* write(char* at, double number) {
  char* const end = fmt::format_to(at, FMT_COMPILE("{}"), number);
  const bool is_whole = std::string_view(at, end).find_first_not_of("-0123456789") == std::string_view::npos;
  return is_whole ? write(end, ".0") : end;
}

char* write(char* at, const Hex& hex) {
  const auto needed = static_cast<unsigned>(std::bit_width(hex.number | 1) + 3) / 4;
  for (unsigned digit = std::max(needed, hex.digits); digit-- > 0;)
    *at++ = digit_of(hex.number >> 4 * digit);
  return at;
}

char* write(char* at, const HexBytes& hex) {
  const auto [bytes, between] = hex;
  for (const std::uint8_t byte : bytes) {
    at[0] = digit_of(byte >> 4);
    at[1] = digit_of(byte);
    at = between.empty() ? at + 2 : write(at + 2, between);
  }
  return bytes.empty() ? at : at - between.size();
}

char* write(char* at, const Padded& padded) {
  const std::size_t needed = fmt::formatted_size(FMT_COMPILE("{}"), padded.number);
  return write_digits(at, padded.number, std::max<std::size_t>(needed, padded.digits));
}

char* write(char* at, const Decimal& decimal) {
  constexpr std::array<std::uint64_t, 10> kScales{1,       10,        100,        1000,        10'000,
                                                  100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};
  const std::uint64_t scale = kScales[decimal.places];
  at = write(at, decimal.number / scale);
  if (decimal.number % scale == 0) return at;
  at = write_digits(write(at, '.'), decimal.number % scale, decimal.places);
  while (at[-1] == '0')
    --at;
  return at;
}

char* write(char* at, const Seconds& seconds) {
  constexpr std::uint64_t kSecond = 1'000'000;
  at = write(write(at, seconds.microseconds / kSecond), '.');
  return write_digits(at, seconds.microseconds % kSecond, 6);
}

}  // namespace cbcan::base

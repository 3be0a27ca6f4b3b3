// SPDX-License-Identifier: MIT
#include "base/buffer.hpp"

#include <array>
#include <bit>

namespace cbcan::base {

namespace {

/// All numbers of two digits.
template <unsigned kBase>
constexpr auto kPairs = [] {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::array<std::array<char, 2>, std::size_t{kBase} * kBase> pairs{};
  for (std::size_t number = 0; number < pairs.size(); ++number)
    pairs[number] = {kDigits[number / kBase], kDigits[number % kBase]};
  return pairs;
}();

template <unsigned kBase>
char* write_pair(char* at, std::size_t number) {
  std::memcpy(at, kPairs<kBase>[number].data(), 2);
  return at + 2;
}

/// The last `count` digits.
template <unsigned kBase, class Number>
char* write_digits(char* at, Number number, std::size_t count) {
  constexpr Number kPair = kBase * kBase;
  std::size_t left = count;
  for (; left >= 2; number /= kPair)
    write_pair<kBase>(at + (left -= 2), number % kPair);
  if (left != 0) *at = kPairs<kBase>[number % kBase][1];
  return at + count;
}

constexpr auto kPowersOf10 = [] {
  std::array<std::uint64_t, 20> powers{1};
  for (std::size_t i = 1; i < powers.size(); ++i)
    powers[i] = 10 * powers[i - 1];
  return powers;
}();

}  // namespace

void Buffer::grow(std::size_t least) {
  room_ = std::max(least, 2 * room_);
  auto larger = std::make_unique_for_overwrite<char[]>(room_);
  std::copy_n(data_, size_, larger.get());
  long_ = std::move(larger);
  data_ = long_.get();
}

char* write_decimal(char* at, std::uint64_t number) {
  constexpr std::uint32_t kFour = 10'000;
  if (number >= kFour)
    return write_digits<10>(write_decimal(at, number / kFour), static_cast<std::uint32_t>(number % kFour), 4);
  const auto low = static_cast<std::uint32_t>(number);
  if (low >= 1000) return write_pair<10>(write_pair<10>(at, low / 100), low % 100);
  if (low >= 100) return write_pair<10>(write(at, low / 100), low % 100);
  return low >= 10 ? write_pair<10>(at, low) : write(at, low);
}

char* write(char* at, const Hex& hex) {
  const auto needed = static_cast<unsigned>(std::bit_width(hex.number | 1) + 3) / 4;
  return write_digits<16>(at, hex.number, std::max(needed, hex.digits));
}

char* write(char* at, const HexBytes& hex) {
  if (hex.between.empty()) {
    for (const std::uint8_t byte : hex.bytes)
      at = write_pair<16>(at, byte);
    return at;
  }
  for (std::string_view between; const std::uint8_t byte : hex.bytes) {
    at = write_pair<16>(write(at, between), byte);
    between = hex.between;
  }
  return at;
}

char* write(char* at, const Padded& padded) {
  for (std::size_t digits = padded.digits; digits > 1 && padded.number < kPowersOf10[digits - 1]; --digits)
    *at++ = '0';
  return write(at, padded.number);
}

char* write(char* at, const Seconds& seconds) {
  constexpr std::uint64_t kSecond = 1'000'000;
  at = write(write(at, seconds.microseconds / kSecond), '.');
  return write_digits<10>(at, static_cast<std::uint32_t>(seconds.microseconds % kSecond), 6);
}

char* write(char* at, const Decimal& decimal) {
  const std::uint64_t scale = kPowersOf10[decimal.places];
  const std::uint64_t fraction = decimal.number % scale;
  at = write(at, decimal.number / scale);
  if (fraction == 0) return at;
  at = write_digits<10>(write(at, '.'), static_cast<std::uint32_t>(fraction), decimal.places);
  while (at[-1] == '0')
    --at;
  return at;
}

}  // namespace cbcan::base

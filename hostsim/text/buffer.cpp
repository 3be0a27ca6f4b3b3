// SPDX-License-Identifier: MIT
#include "text/buffer.hpp"

#include <array>
#include <cstring>

namespace cbcan::text {

namespace {

constexpr std::string_view kDigits = "0123456789ABCDEF";

template <unsigned kBase>
char* write_digits(char* at, std::uint64_t number, unsigned least) {
  unsigned count = 1;
  for (std::uint64_t rest = number; rest >= kBase; rest /= kBase)
    ++count;
  char* const end = at + std::max(count, least);
  for (char* digit = end; digit != at; number /= kBase)
    *--digit = kDigits[number % kBase];
  return end;
}

}  // namespace

char* write(char* at, const Hex& hex) {
  return write_digits<16>(at, hex.number, hex.digits);
}

char* write(char* at, const HexBytes& hex) {
  static constexpr auto kPairs = [] {
    std::array<std::array<char, 2>, 256> pairs{};
    for (std::size_t byte = 0; byte < pairs.size(); ++byte)
      pairs[byte] = {kDigits[byte >> 4], kDigits[byte & 0xF]};
    return pairs;
  }();
  for (std::size_t i = 0; i < hex.bytes.size(); ++i) {
    if (i != 0 && !hex.between.empty()) at = write(at, hex.between);
    std::memcpy(at, kPairs[hex.bytes[i]].data(), 2);
    at += 2;
  }
  return at;
}

char* write(char* at, const Padded& padded) {
  return write_digits<10>(at, padded.number, padded.digits);
}

char* write(char* at, const Seconds& seconds) {
  constexpr std::uint64_t kSecond = 1'000'000;
  at = write(at, seconds.microseconds / kSecond);
  *at = '.';
  return write_digits<10>(at + 1, seconds.microseconds % kSecond, 6);
}

char* write(char* at, const Decimal& decimal) {
  std::uint64_t scale = 1;
  for (unsigned place = 0; place < decimal.places; ++place)
    scale *= 10;
  at = write(at, decimal.number / scale);
  *at = '.';
  at = write_digits<10>(at + 1, decimal.number % scale, decimal.places);
  while (at[-1] == '0')
    --at;
  return at[-1] == '.' ? at - 1 : at;
}

}  // namespace cbcan::text

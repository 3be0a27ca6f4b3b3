// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

namespace cbcan {

/// Copies two machine words at a time, as C libraries for microcontrollers have a memcpy that goes byte by
/// byte. The last copy may repeat bytes. The two blocks do not overlap.
inline void copy_bytes(const std::uint8_t* from, std::uint8_t* to, std::size_t count) {
  constexpr std::size_t kWords = 2 * sizeof(std::size_t);
  if (count >= kWords) {
    const std::uint8_t* const last = from + count - kWords;
    std::uint8_t* const last_to = to + count - kWords;
    for (; from < last; from += kWords, to += kWords)
      __builtin_memcpy(to, from, kWords);
    __builtin_memcpy(last_to, last, kWords);
  } else if (kWords > 8 && count >= 8) {
    __builtin_memcpy(to, from, 8);
    __builtin_memcpy(to + count - 8, from + count - 8, 8);
  } else if (count >= 4) {
    __builtin_memcpy(to, from, 4);
    __builtin_memcpy(to + count - 4, from + count - 4, 4);
  } else {
    for (; count != 0; --count)
      *to++ = *from++;
  }
}

/// Compares 16-bit words. On microcontrollers four at a time: there a library's memcmp is longer than this.
inline bool differ(const std::uint16_t* a, const std::uint16_t* b, std::size_t count) {
  if constexpr (sizeof(std::size_t) > 4) return __builtin_memcmp(a, b, 2 * count) != 0;
  constexpr auto pair = [](const std::uint16_t* at) {
    std::uint32_t number = 0;
    __builtin_memcpy(&number, at, sizeof number);
    return number;
  };
  for (; count >= 4; count -= 4, a += 4, b += 4)
    if (((pair(a) ^ pair(b)) | (pair(a + 2) ^ pair(b + 2))) != 0) return true;
  for (; count != 0; --count)
    if (*a++ != *b++) return true;
  return false;
}

}  // namespace cbcan

// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

namespace cbcan {

/// Two machine words at a time: C libraries for microcontrollers have a memcpy that goes byte by byte. The
/// bytes do not overlap.
inline void copy_bytes(const std::uint8_t* from, std::uint8_t* to, std::size_t count) {
  constexpr std::size_t kWords = 2 * sizeof(std::size_t);
  for (; count >= kWords; count -= kWords, from += kWords, to += kWords)
    __builtin_memcpy(to, from, kWords);
  if (kWords > 8 && count >= 8) {
    __builtin_memcpy(to, from, 8);
    count -= 8, from += 8, to += 8;
  }
  if (count >= 4) {
    __builtin_memcpy(to, from, 4);
    count -= 4, from += 4, to += 4;
  }
  for (; count != 0; --count)
    *to++ = *from++;
}

}  // namespace cbcan

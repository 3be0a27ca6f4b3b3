// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace cbcan {

/// Microseconds since any fixed moment. Monotonic, 64 bits: it never wraps, so times compare with <.
/// The core never reads a clock; whoever calls it says what time it is.
using Time = std::uint64_t;

inline constexpr Time kNever = ~Time{0};
inline constexpr Time kMillisecond = 1000;
inline constexpr Time kSecond = 1000 * kMillisecond;

constexpr Time milliseconds(std::uint32_t count) {
  return count * kMillisecond;
}

constexpr Time earlier(Time a, Time b) {
  return a < b ? a : b;
}

/// The next moment of a period, without drift; after a long sleep, without a burst.
constexpr Time next_after(Time due, Time period, Time now) {
  return due + period > now ? due + period : now + period;
}

}  // namespace cbcan

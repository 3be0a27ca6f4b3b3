// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace cbcan {

/// Microseconds since any fixed moment. Monotonic, 64 bits: it never wraps, so times compare with <.
/// The core never reads a clock: the caller passes the time.
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

/// When a periodic event is due next: without drift, and without a burst after a long delay.
constexpr Time next_after(Time due, Time period, Time now) {
  return due + period > now ? due + period : now + period;
}

}  // namespace cbcan

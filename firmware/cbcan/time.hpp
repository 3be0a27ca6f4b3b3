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

/// time / 1000 modulo 2^32, in steps of 16 bits: a 64-bit division is a library function of 800 bytes.
constexpr std::uint32_t in_milliseconds(Time time) {
  constexpr std::uint32_t kDivisor = kMillisecond;
  const std::uint32_t high = static_cast<std::uint32_t>(time >> 32) % kDivisor << 16 |
                             static_cast<std::uint32_t>(time >> 16 & 0xFFFF);
  const std::uint32_t low = high % kDivisor << 16 | static_cast<std::uint32_t>(time & 0xFFFF);
  return (high / kDivisor << 16) + low / kDivisor;
}

/// From `now` to `due`, rounded up, at most `longest`: the timeout of an operating system's wait.
constexpr std::uint32_t milliseconds_until(Time due, Time now, std::uint32_t longest) {
  if (due <= now) return 0;
  return due - now > milliseconds(longest) ? longest : in_milliseconds(due - now + kMillisecond - 1);
}

}  // namespace cbcan

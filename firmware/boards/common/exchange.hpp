// SPDX-License-Identifier: MIT
#pragma once

/// What the compiler calls for compare-and-swap of one byte and of two bytes on a processor without it. The
/// Modbus server, whose bytes arrive by interrupt, needs it. A file for each processor defines them.

#include <cstdint>

namespace cbcan::boards {

/// A Lock masks interrupts during its lifetime.
template <class Lock, class Word>
bool exchange(volatile Word& word, Word& expected, Word value) {
  const Lock lock;
  const Word seen = word;
  const bool same = seen == expected;
  if (same) word = value;
  expected = seen;
  return same;
}

}  // namespace cbcan::boards

// The compiler declares these names differently, hence asm labels.
extern "C" {
[[gnu::used]] bool exchange_1(volatile std::uint8_t& word, std::uint8_t& expected,
                              std::uint8_t value) asm("__atomic_compare_exchange_1");
[[gnu::used]] bool exchange_2(volatile std::uint16_t& word, std::uint16_t& expected,
                              std::uint16_t value) asm("__atomic_compare_exchange_2");
}

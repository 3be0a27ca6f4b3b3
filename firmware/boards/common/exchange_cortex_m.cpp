// SPDX-License-Identifier: MIT
// What the compiler calls for compare-and-swap on a processor without it, such as Cortex-M0+: it masks
// interrupts. The Modbus server, whose bytes arrive by interrupt, needs it.
#include <cstdint>

#include "boards/common/cortex_m.hpp"

namespace {

using cbcan::boards::InterruptLock;

template <class Word>
bool exchange(volatile Word& word, Word& expected, Word value) {
  const InterruptLock lock;
  const Word seen = word;
  const bool same = seen == expected;
  if (same) word = value;
  expected = seen;
  return same;
}

}  // namespace

// The compiler declares these names differently, hence asm labels.
extern "C" {
[[gnu::used]] bool exchange_1(volatile std::uint8_t& word, std::uint8_t& expected,
                              std::uint8_t value) asm("__atomic_compare_exchange_1");
[[gnu::used]] bool exchange_2(volatile std::uint16_t& word, std::uint16_t& expected,
                              std::uint16_t value) asm("__atomic_compare_exchange_2");
}

bool exchange_1(volatile std::uint8_t& word, std::uint8_t& expected, std::uint8_t value) {
  return exchange(word, expected, value);
}

bool exchange_2(volatile std::uint16_t& word, std::uint16_t& expected, std::uint16_t value) {
  return exchange(word, expected, value);
}

// SPDX-License-Identifier: MIT
// What the compiler calls for a compare-and-swap where the processor has none, as a Cortex-M0+: interrupts
// are masked meanwhile. The Modbus server needs it, whose bytes come by interrupt.
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

// By these names they are the compiler's own, whose declarations differ.
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

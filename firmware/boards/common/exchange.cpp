// SPDX-License-Identifier: MIT
// What the compiler calls for compare-and-swap of one byte and of two bytes on a processor without it:
// Cortex-M0+, and RISC-V with one core in machine mode, with or without extension A, which has words only.
// The Modbus server, whose bytes arrive by interrupt, needs it.
#include <cstdint>

#ifndef __riscv
#include "boards/common/cortex_m.hpp"

using cbcan::boards::InterruptLock;
#endif

namespace {

#ifdef __riscv
/// Masks interrupts during its lifetime; may be nested.
class InterruptLock {
 public:
  InterruptLock() { asm volatile("csrrc %0, mstatus, %1" : "=r"(before_) : "r"(kEnable) : "memory"); }
  ~InterruptLock() { asm volatile("csrs mstatus, %0" ::"r"(before_ & kEnable) : "memory"); }

 private:
  static constexpr unsigned kEnable = 8;  // mstatus.MIE
  unsigned before_;                       ///< mstatus
};
#endif

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
bool exchange_1(volatile std::uint8_t&, std::uint8_t&, std::uint8_t) asm("__atomic_compare_exchange_1");
bool exchange_2(volatile std::uint16_t&, std::uint16_t&, std::uint16_t) asm("__atomic_compare_exchange_2");

[[gnu::used]] bool exchange_1(volatile std::uint8_t& word, std::uint8_t& expected, std::uint8_t value) {
  return exchange(word, expected, value);
}

[[gnu::used]] bool exchange_2(volatile std::uint16_t& word, std::uint16_t& expected, std::uint16_t value) {
  return exchange(word, expected, value);
}

// SPDX-License-Identifier: MIT
// For RISC-V with one core in machine mode, with or without extension A, which has words only.
#include "boards/common/exchange.hpp"

namespace {

constexpr unsigned kInterruptEnable = 8;  // mstatus.MIE

/// Masks interrupts during its lifetime; may be nested.
class InterruptLock {
 public:
  InterruptLock() {
    asm volatile("csrrc %0, mstatus, %1" : "=r"(before_) : "r"(kInterruptEnable) : "memory");
  }
  ~InterruptLock() { asm volatile("csrs mstatus, %0" ::"r"(before_ & kInterruptEnable) : "memory"); }
  InterruptLock(const InterruptLock&) = delete;
  InterruptLock& operator=(const InterruptLock&) = delete;

 private:
  unsigned before_;  ///< mstatus
};

}  // namespace

using cbcan::boards::exchange;

bool exchange_1(volatile std::uint8_t& word, std::uint8_t& expected, std::uint8_t value) {
  return exchange<InterruptLock>(word, expected, value);
}

bool exchange_2(volatile std::uint16_t& word, std::uint16_t& expected, std::uint16_t value) {
  return exchange<InterruptLock>(word, expected, value);
}

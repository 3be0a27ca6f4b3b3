// SPDX-License-Identifier: MIT
#pragma once

/// One of the two 32-bit timers of the STM32F4, TIM2 or TIM5 (RM0390, chapter 17): counts microseconds
/// without end, and its first compare channel ends a sleep.

#include <cstdint>

namespace cbcan::boards::stm32f4 {

template <class Registers>
class MicrosecondTimer {
 public:
  explicit MicrosecondTimer(Registers registers) : registers_(registers) {}

  /// `clock` in Hz, a multiple of 1 MHz.
  void start(std::uint32_t clock) {
    registers_.write(kPsc, clock / 1'000'000 - 1);
    registers_.write(kArr, 0xFFFFFFFF);
    registers_.write(kEgr, kUg);  // loads the prescaler
    registers_.write(kCr1, kCen);
  }

  /// Continues counting microseconds after a change of the clock. No interrupt may call read() meanwhile;
  /// wake_at() stays in effect.
  void set_clock(std::uint32_t clock) {
    const std::uint32_t now = read();
    registers_.write(kPsc, clock / 1'000'000 - 1);
    registers_.write(kEgr, kUg);  // clears the counter too
    registers_.write(kCnt, now);
  }

  /// Microseconds, wraps at 2^32. From any context.
  std::uint32_t read() const { return registers_.read(kCnt); }

  /// One interrupt when read() is `at`, or immediately if that has passed; up to 2^31 - 1 us ahead or back.
  /// Replaces an earlier request.
  void wake_at(std::uint32_t at) {
    registers_.write(kCcr1, at);
    registers_.write(kSr, ~kCc1);
    registers_.write(kDier, kCc1);
    // The moment may have passed while it was being set: the next match would be 71 minutes later.
    if (static_cast<std::int32_t>(at - read()) <= 0) registers_.write(kEgr, kCc1);
  }

  void on_interrupt() {
    registers_.write(kDier, 0);
    registers_.write(kSr, ~kCc1);  // write 0 to clear
  }

 private:
  static constexpr std::uint32_t kCr1 = 0x00, kCen = 1;
  static constexpr std::uint32_t kDier = 0x0C;
  static constexpr std::uint32_t kSr = 0x10;
  static constexpr std::uint32_t kEgr = 0x14, kUg = 1;
  static constexpr std::uint32_t kCc1 = 2;  ///< CC1IE, CC1IF, CC1G
  static constexpr std::uint32_t kCnt = 0x24, kPsc = 0x28, kArr = 0x2C, kCcr1 = 0x34;

  Registers registers_;
};

}  // namespace cbcan::boards::stm32f4

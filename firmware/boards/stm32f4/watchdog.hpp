// SPDX-License-Identifier: MIT
#pragma once

/// The independent watchdog of the STM32F4 (RM0390, chapter 20): its own oscillator resets a program that
/// does not feed it. Once started, only a reset stops it.

#include <cstdint>

namespace cbcan::boards::stm32f4 {

template <class Registers>
class Watchdog {
 public:
  explicit Watchdog(Registers registers) : registers_(registers) {}

  /// 4096 periods of LSI / 32: 4.1 s at its nominal 32 kHz; 2.8..7.7 s at the 17..47 kHz that the data sheet
  /// allows.
  void start() {
    registers_.write(kKr, kStart);
    registers_.write(kKr, kUnlock);
    registers_.write(kPr, kBy32);  // RLR is 4095 after reset
    feed();
  }
  /// Starts another period; locks the registers.
  void feed() { registers_.write(kKr, kReload); }

 private:
  static constexpr std::uint32_t kKr = 0x00, kReload = 0xAAAA, kUnlock = 0x5555, kStart = 0xCCCC;
  static constexpr std::uint32_t kPr = 0x04, kBy32 = 3;

  Registers registers_;
};

}  // namespace cbcan::boards::stm32f4

// SPDX-License-Identifier: MIT
#pragma once

/// The smaller peripherals of the STM32F4: pins, a timer, the watchdog.

#include <cstdint>

#include "boards/common/registers.hpp"

namespace cbcan::boards::stm32 {

enum class Pull : std::uint8_t { kNone = 0, kUp = 1 };

/// One port of general-purpose pins of the STM32F4 (RM0390, chapter 7), as far as the drivers need it. To be
/// called from one context.
template <class Registers>
class Gpio {
 public:
  explicit Gpio(Registers registers) : registers_(registers) {}

  /// Assigns pin 0..15 to a peripheral: alternate function 0..15, push-pull, medium speed.
  void set_alternate(unsigned pin, std::uint32_t function, Pull pull) {
    const unsigned at = pin % 8 * 4;
    modify(registers_, pin < 8 ? kAfrl : kAfrh, 15u << at, function << at);
    set_pair(kPupdr, pin, static_cast<std::uint32_t>(pull));
    set_pair(kOspeedr, pin, kMedium);
    set_pair(kModer, pin, kAlternate);
  }

  /// True if the pin, an input as after reset, is high.
  bool read(unsigned pin) const { return (registers_.read(kIdr) >> pin & 1) != 0; }

  /// A push-pull output, low at first.
  void set_output(unsigned pin) {
    write(pin, false);
    set_pair(kModer, pin, kOutput);
  }
  /// Atomic: from any context.
  void write(unsigned pin, bool high) { registers_.write(kBsrr, 1u << (high ? pin : pin + 16)); }

 private:
  static constexpr std::uint32_t kModer = 0x00, kOutput = 1, kAlternate = 2;
  static constexpr std::uint32_t kOspeedr = 0x08, kMedium = 1;
  static constexpr std::uint32_t kPupdr = 0x0C;
  static constexpr std::uint32_t kIdr = 0x10;
  static constexpr std::uint32_t kBsrr = 0x18;  ///< write 1: lower half sets, upper half resets
  static constexpr std::uint32_t kAfrl = 0x20, kAfrh = 0x24;

  void set_pair(std::uint32_t offset, unsigned pin, std::uint32_t value) {
    modify(registers_, offset, 3u << pin * 2, value << pin * 2);
  }

  Registers registers_;
};

/// One of the two 32-bit timers of the STM32F4, TIM2 or TIM5 (RM0390, chapter 17): counts microseconds
/// without end, and its first compare channel ends a sleep.
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

/// The independent watchdog of the STM32F4 (RM0390, chapter 20): its own oscillator resets a program that
/// does not feed it. Once started, only a reset stops it.
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

}  // namespace cbcan::boards::stm32

// SPDX-License-Identifier: MIT
#pragma once

/// One port of general-purpose pins of the STM32F4 (RM0390, chapter 7), as far as the drivers need it. To be
/// called from one context.

#include <cstdint>

#include "boards/common/registers.hpp"

namespace cbcan::boards::stm32f4 {

enum class Pull : std::uint8_t { kNone = 0, kUp = 1 };

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

}  // namespace cbcan::boards::stm32f4

// SPDX-License-Identifier: MIT
#pragma once

/// A model of the USART of the STM32F4 (RM0390, chapter 25) and G4 (RM0440, chapter 37; chip_numbers.hpp):
/// data and shift register in each direction, the flags and how they are cleared, the interrupt line. The
/// test plays the line: it decides when a character ends. Not modelled: baud rate, bits on the line, DMA,
/// other modes.

#include <cstdint>
#include <optional>
#include <stdexcept>

#include "chip_numbers.hpp"

namespace cbcan::test {

struct UsartModel {
  /// Flags of SR that come with a received byte.
  enum Fault : std::uint32_t { kGood = 0, kParity = 0x1, kFraming = 0x2, kNoise = 0x4 };

  std::uint32_t read(std::uint32_t offset) {
    switch (offset) {
      case numbers::kSr: seen_ = sr_; return sr_;
      case numbers::kRdr:
        // Read SR, then DR: clears the error flags that were read. The STM32G4 has ICR for that.
        sr_ &= ~((kHasIcr ? 0 : seen_ & 0x0F) | 0x20);
        return received_;
      case numbers::kBrr: return brr_;
      case numbers::kCr1: return cr1_;
      case numbers::kCr2: return cr2_;
    }
    throw std::logic_error("the USART has no such register");
  }

  void write(std::uint32_t offset, std::uint32_t value) {
    const bool locked =
        kHasIcr && (cr1_ & numbers::kUe) != 0 && (offset != numbers::kCr1 || (value & numbers::kUe) != 0);
    if (locked && (offset == numbers::kBrr || offset == numbers::kCr2 ||
                   (offset == numbers::kCr1 && ((value ^ cr1_) & 0x1600) != 0)))
      throw std::logic_error("written while UE locks it");
    switch (offset) {
      case numbers::kIcr: sr_ &= ~(value & 0x4F); return;
      case numbers::kTdr: return write_data(value);
      case numbers::kBrr: brr_ = value & 0xFFFF; return;
      case numbers::kCr1: cr1_ = value & 0xBFFF; return;
      case numbers::kCr2: cr2_ = value & 0x7F6F; return;
    }
    throw std::logic_error("the USART has no such register");
  }

  /// TXE, TC, RXNE and ORE with RXNEIE, PE with PEIE.
  bool line() const {
    return (sr_ & cr1_ & 0xC0) != 0 || ((cr1_ & 0x20) != 0 && (sr_ & 0x28) != 0) ||
           ((cr1_ & 0x100) != 0 && (sr_ & 1) != 0);
  }

  /// A character has arrived. If the previous one has not been read, this one is lost.
  void receive(std::uint8_t byte, std::uint32_t faults = kGood) {
    if ((cr1_ & (numbers::kUe | 0x4)) != (numbers::kUe | 0x4)) return;  // UE, RE
    if ((sr_ & 0x20) != 0) {
      sr_ |= 0x08;
      return;
    }
    received_ = byte;
    sr_ |= 0x20 | faults;
  }

  /// The character in the shift register has been sent; the next one follows.
  std::optional<std::uint8_t> shift_out() {
    if (!shifting_) return {};
    const std::uint8_t byte = *shifting_;
    shifting_ = waiting_;
    waiting_.reset();
    sr_ |= shifting_ ? 0x80u : 0xC0u;
    return byte;
  }

 private:
  static constexpr bool kHasIcr = numbers::kIcr != ~0u;

  void write_data(std::uint32_t value) {
    if ((cr1_ & (numbers::kUe | 0x8)) != (numbers::kUe | 0x8))
      throw std::logic_error("sent without UE and TE");
    if ((sr_ & 0x80) == 0) throw std::logic_error("DR was overwritten before it was sent");
    sr_ &= ~(kHasIcr ? 0x40 : seen_ & 0x40);  // read SR, then write DR: clears TC
    const auto byte = static_cast<std::uint8_t>(value);
    if (!shifting_) {
      shifting_ = byte;
      return;
    }
    waiting_ = byte;
    sr_ &= ~0x80u;
  }

  std::uint32_t sr_ = 0xC0, seen_ = 0, received_ = 0, brr_ = 0, cr1_ = 0, cr2_ = 0;
  std::optional<std::uint8_t> shifting_, waiting_;
};

}  // namespace cbcan::test

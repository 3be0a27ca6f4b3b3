// SPDX-License-Identifier: MIT
#pragma once

/// A model of the STM32F4's USART, from RM0390, chapter 25: data and shift register in each direction, the
/// flags and how they are cleared, the interrupt line. The test plays the line: it decides when a character
/// ends. Not modelled: baud rate, bits on the line, DMA, other modes.

#include <cstdint>
#include <optional>
#include <stdexcept>

namespace cbcan::test {

struct UsartModel {
  /// Flags of SR that come with a received byte.
  enum Fault : std::uint32_t { kGood = 0, kParity = 0x1, kFraming = 0x2, kNoise = 0x4 };

  std::uint32_t read(std::uint32_t offset) {
    switch (offset) {
      case 0x00: seen_ = sr_; return sr_;
      case 0x04:
        // Read SR, then DR: clears the error flags that were read.
        sr_ &= ~((seen_ & 0x0F) | 0x20);
        return received_;
      case 0x08: return brr_;
      case 0x0C: return cr1_;
      case 0x10: return cr2_;
      case 0x14: return cr3_;
    }
    throw std::logic_error("the USART has no such register");
  }

  void write(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
      case 0x00: sr_ &= value | ~0x60u; return;  // RXNE and TC: write 0 to clear
      case 0x04: return write_data(value);
      case 0x08: brr_ = value & 0xFFFF; return;
      case 0x0C: cr1_ = value & 0xBFFF; return;
      case 0x10: cr2_ = value & 0x7F6F; return;
      case 0x14: cr3_ = value & 0x0FFF; return;
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
    if ((cr1_ & 0x2004) != 0x2004) return;  // UE, RE
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
  void write_data(std::uint32_t value) {
    if ((cr1_ & 0x2008) != 0x2008) throw std::logic_error("sent without UE and TE");
    if ((sr_ & 0x80) == 0) throw std::logic_error("DR was overwritten before it was sent");
    sr_ &= ~(seen_ & 0x40);  // read SR, then write DR: clears TC
    const auto byte = static_cast<std::uint8_t>(value);
    if (!shifting_) {
      shifting_ = byte;
      return;
    }
    waiting_ = byte;
    sr_ &= ~0x80u;
  }

  std::uint32_t sr_ = 0xC0, seen_ = 0, received_ = 0, brr_ = 0, cr1_ = 0, cr2_ = 0, cr3_ = 0;
  std::optional<std::uint8_t> shifting_, waiting_;
};

}  // namespace cbcan::test

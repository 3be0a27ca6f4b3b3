// SPDX-License-Identifier: MIT
#pragma once

/// Driver of the USART of STM32F1/F2/F4 (RM0390, chapter 25) and G0/G4/H7 (RM0440, chapter 37) for a protocol
/// of requests and responses, such as Modbus RTU: every received byte goes to a handler in the interrupt, and
/// a response is sent from the caller's memory. Nothing blocks.

#include <atomic>
#include <cstdint>
#include <span>

#include "boards/common/registers.hpp"
#include "chip.hpp"

namespace cbcan::boards::stm32 {

/// Data bits, parity, stop bits. Modbus requires 8E1, or 8N2 without parity; many devices use 8N1.
enum class SerialFormat : std::uint8_t { k8E1, k8O1, k8N1, k8N2 };

/// Bits of a character, with start, parity and stop bits.
constexpr std::uint32_t bits(SerialFormat format) {
  return format == SerialFormat::k8N1 ? 10 : 11;
}

struct UsartCounters {
  std::uint32_t parity = 0;    ///< bytes with a wrong parity
  std::uint32_t framing = 0;   ///< bytes without a stop bit, or breaks
  std::uint32_t overrun = 0;   ///< bytes lost because the interrupt came too late
  std::uint32_t given_up = 0;  ///< responses whose end was not reported
};

template <class Registers>
class Usart {
 public:
  explicit Usart(Registers registers) : registers_(registers) {}

  /// `clock` is that of the USART's bus, in Hz. False: it does not give this rate.
  bool init(std::uint32_t clock, std::uint32_t baud, SerialFormat format) {
    baud_ = baud;
    bits_ = bits(format);
    if constexpr (usart::kIcr != 0) registers_.write(kCr1, 0);  // unlocks the others
    if (!set_clock(clock)) return false;
    registers_.write(kCr2, format == SerialFormat::k8N2 ? kTwoStopBits : 0);
    // The parity bit counts as a ninth data bit.
    const bool parity = format == SerialFormat::k8E1 || format == SerialFormat::k8O1;
    registers_.write(
        kCr1, kEnabled | (parity ? kNineBits | kParity : 0) | (format == SerialFormat::k8O1 ? kOdd : 0));
    return true;
  }

  /// The bus clock has changed. A character in progress is lost. False: the baud rate is outside clock /
  /// 65535 .. clock / 16. With oversampling by 16, mantissa and fraction together are the divider (25.4.4).
  bool set_clock(std::uint32_t clock) {
    constexpr std::uint32_t kLeast = 16, kMost = 0xFFFF;
    const std::uint32_t divider = baud_ == 0 ? 0 : (clock + baud_ / 2) / baud_;
    if (divider < kLeast || divider > kMost) return false;
    const std::uint32_t control = usart::kIcr != 0 ? registers_.read(kCr1) : 0;
    if constexpr (usart::kIcr != 0) registers_.write(kCr1, control & ~kUe);
    registers_.write(kBrr, divider);
    if constexpr (usart::kIcr != 0) registers_.write(kCr1, control);
    return true;
  }

  /// True from send() to on_sent().
  bool is_sending() { return (registers_.read(kCr1) & (kTxeie | kTcie)) != 0; }

  /// Call in the loop, while nothing is being sent. The bytes, at least one, stay valid until on_sent().
  void send(std::span<const std::uint8_t> bytes) {
    constexpr std::uint32_t kMore = 2;  // in DR and in the shift register
    watched_ = false;
    most_us_ =
        (static_cast<std::uint32_t>(bytes.size()) + kMore) * bits_ * 1'000'000 / baud_ * 5 / 4 + kLateUs;
    rest_ = bytes;
    std::atomic_signal_fence(std::memory_order_release);  // rest_ first
    modify(registers_, kCr1, 0, kTxeie);
  }

  /// Call in each turn of the loop, with interrupts off. True: the end of a response is overdue, for example
  /// after a lost interrupt. The response is abandoned; the caller does what on_sent() does.
  bool give_up(std::uint32_t now_us) {
    if (!is_sending()) return false;
    if (!watched_) since_us_ = now_us;
    watched_ = true;
    if (now_us - since_us_ < most_us_) return false;
    modify(registers_, kCr1, kTxeie | kTcie, 0);
    rest_ = {};
    ++counters_.given_up;
    return true;
  }

  /// Call in the USART's interrupt. Calls handler.on_byte(byte) for a received byte, or
  /// handler.on_broken_byte() if parity or framing is wrong or the next byte was lost, and handler.on_sent()
  /// after the last stop bit, when an RS-485 driver can be switched off.
  void on_interrupt(auto& handler) {
    const std::uint32_t status = registers_.read(kSr);
    if ((status & (kRxne | kOre)) != 0) receive(status, handler);
    if ((registers_.read(kCr1) & kTxeie) != 0) send_more();
    if ((registers_.read(kCr1) & kTcie) == 0 || (registers_.read(kSr) & kTc) == 0) return;
    modify(registers_, kCr1, kTcie, 0);
    handler.on_sent();
  }

  /// Written by the interrupt, or with interrupts off.
  const UsartCounters& counters() const { return counters_; }

 private:
  static constexpr std::uint32_t kLateUs = 10'000;  ///< for a late interrupt or loop

  static constexpr std::uint32_t kSr = usart::kStatus;
  static constexpr std::uint32_t kPe = bit(0), kFe = bit(1), kNe = bit(2), kOre = bit(3), kRxne = bit(5);
  static constexpr std::uint32_t kTc = bit(6), kTxe = bit(7);
  static constexpr std::uint32_t kBrr = usart::kBrr;
  static constexpr std::uint32_t kCr1 = usart::kCr1;
  static constexpr std::uint32_t kRe = bit(2), kTe = bit(3), kRxneie = bit(5), kTcie = bit(6),
                                 kTxeie = bit(7);
  static constexpr std::uint32_t kOdd = bit(9), kParity = bit(10), kNineBits = bit(12), kUe = usart::kUe;
  static constexpr std::uint32_t kEnabled = kUe | kRxneie | kTe | kRe;
  static constexpr std::uint32_t kCr2 = usart::kCr2;
  static constexpr std::uint32_t kTwoStopBits = bit(13);

  /// Reading SR, then DR clears the flags; ICR those of errors.
  void receive(std::uint32_t status, auto& handler) {
    const auto byte = static_cast<std::uint8_t>(registers_.read(usart::kRdr));
    if constexpr (usart::kIcr != 0) registers_.write(usart::kIcr, status & (kPe | kFe | kNe | kOre));
    if ((status & kOre) != 0) ++counters_.overrun;
    if ((status & kPe) != 0) ++counters_.parity;
    if ((status & kFe) != 0) ++counters_.framing;
    if ((status & (kPe | kFe | kOre)) == 0)
      handler.on_byte(byte);
    else
      handler.on_broken_byte();
  }

  /// Writing DR, after SR was read, clears TC: so after the last byte it reports the end of that byte.
  void send_more() {
    while (!rest_.empty()) {
      if ((registers_.read(kSr) & kTxe) == 0) return;
      registers_.write(usart::kTdr, rest_.front());
      rest_ = rest_.subspan(1);
    }
    modify(registers_, kCr1, kTxeie, kTcie);
  }

  Registers registers_;
  std::uint32_t baud_ = 0;
  std::uint32_t bits_ = 0;      ///< of a character
  std::uint32_t most_us_ = 0;   ///< time for sending, with a margin
  std::uint32_t since_us_ = 0;  ///< when the loop first saw the response
  bool watched_ = false;
  std::span<const std::uint8_t> rest_;  ///< of the response being sent
  UsartCounters counters_;
};

}  // namespace cbcan::boards::stm32

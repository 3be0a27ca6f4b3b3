// SPDX-License-Identifier: MIT
#pragma once

/// Which clock the board runs on, and what follows from it.
///
/// A CAN bus bears clocks that differ by 0.49 % with 16 quanta a bit, the RC oscillator has 1 % and more. So
/// the board starts on the RC oscillator at once, with Modbus, and with CAN1 as its reset leaves it: it sends
/// nothing and acknowledges nothing. When the 8 MHz come, whenever that is, core, timer and USART go over to
/// them between two Modbus frames, and CAN joins the bus. When they fail, the NMI puts CAN1 into its reset
/// and the loop does the rest. A CAN controller that does not do what it is asked for is reset and begins
/// anew.

#include <atomic>
#include <cstdint>

#include "boards/stm32f4/bxcan.hpp"
#include "boards/stm32f4/rcc.hpp"
#include "boards/stm32f4/settings.hpp"
#include "boards/stm32f4/timer.hpp"
#include "boards/stm32f4/usart.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards::stm32f4 {

template <class Registers>
class ClockSupervisor {
 public:
  /// All live as long as this.
  ClockSupervisor(Rcc<Registers>& rcc, MicrosecondTimer<Registers>& timer, Usart<Registers>& usart,
                  BxCan<Registers>& can, const Settings& settings)
      : rcc_(rcc), timer_(timer), usart_(usart), can_(can), settings_(settings) {}

  /// The peripherals have their clocks (Rcc::enable). CAN does not join the bus before `can_from`.
  void start(Time can_from = 0) {
    can_from_ = can_from;
    rcc_.return_to_hsi();
    timer_.start(kHsiClocks.timers);
    usart_.init(usart_clock(kHsiClocks), settings_.baud, settings_.format);
  }

  /// In each interrupt of the USART, with the time in us.
  void on_line_used(std::uint32_t now_us) { line_used_us_.store(now_us, std::memory_order_relaxed); }

  /// In the NMI. The loop is to be woken, by an interrupt: it may be about to sleep.
  void on_nmi() { rcc_.on_nmi(); }

  /// In each turn of the loop, with interrupts off: the time in us as the timer has it.
  void follow(std::uint32_t now_us) {
    if (rcc_.take_failure()) {
      rcc_.return_to_hsi();
      can_.stop();
      retime(kHsiClocks);
      on_hse_ = false;
    }
    if (on_hse_ || !rcc_.hse_ready(settings_.hse_is_clock) || !between_frames(now_us)) return;
    on_hse_ = rcc_.switch_to_hse();
    if (on_hse_)
      retime(kHseClocks);
    else
      rcc_.return_to_hsi();
  }

  /// After follow(); returns when both want to be called next.
  Time poll_can(Time now) {
    if (!on_hse_) return now + kLook;
    if (now < can_from_) return can_from_;
    if (can_.stopped()) {
      rcc_.reset_can1();
      can_.init(kHseClocks.apb1, settings_.can_bit_rate, settings_.node_id, now);
      return now;  // an NMI before the end of that reset has not been seen yet: follow() comes first
    }
    return can_.poll(now);
  }

  regmap::ClockSource source() const {
    return on_hse_ ? regmap::ClockSource::kExternal : regmap::ClockSource::kInternal;
  }

 private:
  static constexpr Time kLook = kMillisecond;  ///< less than half a silence between two Modbus frames

  /// Half of t3.5 after a character: the frame is over (t1.5), and the next one may not begin yet.
  bool between_frames(std::uint32_t now_us) {
    const std::uint32_t silence = rtu_silence_us(settings_.baud, bits(settings_.format));
    return !usart_.is_sending() && now_us - line_used_us_.load(std::memory_order_relaxed) >= silence / 2;
  }

  void retime(const Clocks& clocks) {
    timer_.set_clock(clocks.timers);
    usart_.set_clock(usart_clock(clocks));
  }

  std::uint32_t usart_clock(const Clocks& clocks) const {
    return settings_.line == ModbusLine::kRs485 ? clocks.apb2 : clocks.apb1;
  }

  Rcc<Registers>& rcc_;
  MicrosecondTimer<Registers>& timer_;
  Usart<Registers>& usart_;
  BxCan<Registers>& can_;
  Settings settings_;
  Time can_from_ = 0;
  bool on_hse_ = false;
  std::atomic<std::uint32_t> line_used_us_ = 0;
};

}  // namespace cbcan::boards::stm32f4

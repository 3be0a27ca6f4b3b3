// SPDX-License-Identifier: MIT
#pragma once

/// Selects the board's clock, and adapts the peripherals to it.
///
/// A CAN bus tolerates clocks that differ by 0.49 % with 16 quanta a bit; the RC oscillator is off by 1 % and
/// more. So the board starts on the RC oscillator with Modbus only; the CAN controller stays in its reset
/// state, in which it sends and acknowledges nothing. When the clock of HSE is ready, whenever that is, core,
/// timer and USART switch to it between two Modbus frames, and CAN joins the bus. If it fails, the NMI resets
/// the controller and the loop does the rest. A CAN controller that does not respond is reset and started
/// again.

#include <atomic>
#include <cstdint>

#include "boards/stm32/peripherals.hpp"
#include "boards/stm32/rcc.hpp"
#include "boards/stm32/settings.hpp"
#include "boards/stm32/usart.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"
#include "chip.hpp"

namespace cbcan::boards::stm32 {

template <class Registers>
class ClockSupervisor {
 public:
  /// All outlive this.
  ClockSupervisor(Rcc<Registers>& rcc, MicrosecondTimer<Registers>& timer, Usart<Registers>& usart,
                  Can<Registers>& can, const Settings& settings)
      : rcc_(rcc), timer_(timer), usart_(usart), can_(can), settings_(settings) {}

  /// Call it after Rcc::enable(). CAN does not join the bus before `can_from`.
  void start(Time can_from = 0) {
    can_from_ = can_from;
    rcc_.return_to_hsi();
    timer_.start(kHsiClocks.timers);
    usart_.init(usart_clock(kHsiClocks), settings_.baud, settings_.format);
  }

  /// Call in each interrupt of the USART, with the time in us.
  void on_line_used(std::uint32_t now_us) { line_used_us_.store(now_us, std::memory_order_relaxed); }

  /// Call in the NMI, which must also wake the loop by an interrupt: the loop may be about to sleep. False:
  /// it is not HSE that has failed.
  bool on_nmi() { return rcc_.on_nmi(); }

  /// Call in each turn of the loop, with interrupts off, with the timer's time in us.
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

  /// Call after follow(); returns the time of the next call of both.
  Time poll_can(Time now) {
    if (!on_hse_) return now + kLook;
    if (now < can_from_) return can_from_;
    if (can_.stopped()) {
      rcc_.reset_can();
      can_.init(kHseClocks.apb1, settings_.can_bit_rate, settings_.node_id, now);
      return now;  // an NMI during that reset has not been handled yet: follow() comes first
    }
    return can_.poll(now);
  }

  regmap::ClockSource source() const {
    return on_hse_ ? regmap::ClockSource::kExternal : regmap::ClockSource::kInternal;
  }

 private:
  static constexpr Time kLook = kMillisecond;  ///< less than half a silence between two Modbus frames

  /// Half of t3.5 after a character the frame has ended (t1.5), and the next one may not begin yet.
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
  Can<Registers>& can_;
  Settings settings_;
  Time can_from_ = 0;
  bool on_hse_ = false;
  std::atomic<std::uint32_t> line_used_us_ = 0;
};

}  // namespace cbcan::boards::stm32

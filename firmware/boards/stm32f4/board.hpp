// SPDX-License-Identifier: MIT
#pragma once

/// A board with an STM32F446, such as Nucleo-F446RE:
///
///   CAN1    PB8 (D15) receives, PB9 (D14) sends, to a transceiver
///   LEDs    RUN is PA5 (LD2), ERR is PB5 (D4), both on when high
///   PC13    the blue button: if held at start, stored parameters are ignored
///   USART   Modbus RTU, one of two lines (settings.hpp)
///   TIM2    time, and end of a sleep; the watchdog resets a loop that hangs for some seconds

#include <cstdint>
#include <span>

#include "boards/common/clock.hpp"
#include "boards/common/cortex_m.hpp"
#include "boards/common/fault_record.hpp"
#include "boards/common/indicators.hpp"
#include "boards/common/registers.hpp"
#include "boards/common/station.hpp"
#include "boards/stm32f4/bxcan.hpp"
#include "boards/stm32f4/clock_supervisor.hpp"
#include "boards/stm32f4/peripherals.hpp"
#include "boards/stm32f4/settings.hpp"
#include "boards/stm32f4/usart.hpp"

namespace cbcan::boards::stm32f4 {

// Interrupt numbers (RM0390, table 38).
inline constexpr std::size_t kCan1Rx0Interrupt = 20;
inline constexpr std::size_t kCan1Rx1Interrupt = 21;
inline constexpr std::size_t kCan1SceInterrupt = 22;
inline constexpr std::size_t kTim2Interrupt = 28;
inline constexpr std::size_t kUsart1Interrupt = 37;
inline constexpr std::size_t kUsart2Interrupt = 38;
inline constexpr std::size_t kInterrupts = 97;

class Board final : public Hardware {
 public:
  Board(const Settings& settings, FaultRecord& faults);

  /// Sets up pins, peripherals and interrupts. CAN starts when its clock is there (clock_supervisor.hpp) and
  /// the wait after faults has ended. `modbus` receives the line's bytes.
  void start(RtuServer& modbus);

  CanPort& can() { return can_; }
  /// Feeds the watchdog, shows the own node's state, and sleeps until an interrupt or `due`, at most
  /// Sleep::kLongest.
  void sleep_until(Time due, nmt::State state);

  // Hardware.
  Time now() override { return clock_.now(timer_.read()); }
  bool receive(std::size_t /*network*/, Frame& frame) override { return can_.receive(frame); }
  BusState bus_state(std::size_t /*network*/) override { return can_.state(); }
  void respond(std::span<const std::uint8_t> response) override;
  Health health(std::size_t network) override;

  // Interrupts.
  void on_nmi();
  void on_can_received();
  void on_can_error();
  void on_modbus();
  void on_timer();

  // Called by the USART driver in its interrupt.
  void on_byte(std::uint8_t byte) { modbus_->on_byte(byte, timer_.read()); }
  void on_broken_byte() { modbus_->on_broken_byte(timer_.read()); }
  void on_sent();

 private:
  bool is_rs485() const { return settings_.line == ModbusLine::kRs485; }
  std::size_t modbus_interrupt() const { return is_rs485() ? kUsart1Interrupt : kUsart2Interrupt; }
  void set_pins();

  Settings settings_;
  FaultRecord& faults_;
  Rcc<Mmio> rcc_{Mmio(0x40023800), Mmio(0x40023C00)};
  Gpio<Mmio> port_a_{Mmio(0x40020000)};
  Gpio<Mmio> port_b_{Mmio(0x40020400)};
  MicrosecondTimer<Mmio> timer_{Mmio(0x40000000)};
  Watchdog<Mmio> watchdog_{Mmio(0x40003000)};
  BxCan<Mmio> can_{Mmio(0x40006400)};
  Usart<Mmio> usart_;
  ClockSupervisor<Mmio> supervisor_;
  Indicators indicators_;
  Clock clock_;
  regmap::ResetCause reset_cause_ = regmap::ResetCause::kUnknown;
  RtuServer* modbus_ = nullptr;
  Sleep sleep_;
};

}  // namespace cbcan::boards::stm32f4

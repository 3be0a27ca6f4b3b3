// SPDX-License-Identifier: MIT
#pragma once

/// A board with the chip of chip.hpp, such as a Nucleo-64 board:
///
///   CAN     as chip.hpp says, to a transceiver
///   LEDs    RUN is PA5 (LD2), ERR is PB5 (D4), both on when high
///   USART   Modbus RTU, one of two lines (settings.hpp)
///   TIM2    time, and end of a sleep; the watchdog resets a loop that hangs for some seconds

#include <cstdint>
#include <span>

#include "boards/common/clock.hpp"
#include "boards/common/cortex_m.hpp"
#include "boards/common/indicators.hpp"
#include "boards/common/registers.hpp"
#include "boards/common/station.hpp"
#include "boards/stm32/clock_supervisor.hpp"
#include "boards/stm32/peripherals.hpp"
#include "boards/stm32/settings.hpp"
#include "boards/stm32/usart.hpp"
#include "chip.hpp"

namespace cbcan::boards::stm32 {

// Interrupt numbers (RM0390, table 38; RM0440, vector table).
inline constexpr std::size_t kTim2Interrupt = 28, kUsart1Interrupt = 37, kUsart2Interrupt = 38;

class Board final : public Hardware {
 public:
  explicit Board(const Settings& settings);

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
  void on_can();
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
  Rcc<Mmio> rcc_{Mmio(kRccBase), Mmio(kFlashBase)};
  Gpio<Mmio> port_a_{Mmio(kPortsBase)};
  Gpio<Mmio> port_b_{Mmio(kPortsBase + 0x400)};
  MicrosecondTimer<Mmio> timer_{Mmio(0x40000000)};
  Watchdog<Mmio> watchdog_{Mmio(0x40003000)};
  Can<Mmio> can_ = make_can();
  Usart<Mmio> usart_;
  ClockSupervisor<Mmio> supervisor_;
  Indicators indicators_;
  Clock clock_;
  regmap::ResetCause reset_cause_ = regmap::ResetCause::kUnknown;
  RtuServer* modbus_ = nullptr;
  Sleep sleep_;
};

/// The program after its constructors. `vectors`: its table; `store` keeps the parameters, null: nothing
/// does.
[[noreturn]] void run(Board& board, TheStation& station, const void* vectors, ParameterMemory* store);

/// The vector table; interrupts call `kBoard`.
template <Board& kBoard>
constexpr VectorTable<kInterrupts> vectors_of() {
  VectorTable<kInterrupts> table;
  table.nmi = [] { kBoard.on_nmi(); };
  table.interrupts.fill(fault_handler);
  for (const std::size_t can : kCanInterrupts)
    table.interrupts[can] = [] { kBoard.on_can(); };
  table.interrupts[kTim2Interrupt] = [] { kBoard.on_timer(); };
  for (const std::size_t line : {kUsart1Interrupt, kUsart2Interrupt})
    table.interrupts[line] = [] { kBoard.on_modbus(); };
  return table;
}

}  // namespace cbcan::boards::stm32

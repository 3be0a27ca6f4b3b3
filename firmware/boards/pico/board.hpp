// SPDX-License-Identifier: MIT
#pragma once

/// Raspberry Pi Pico, or another board with an RP2040, and a module with an MCP2515:
///
///   SPI0    GP16 (from the module), GP18, GP19 to the MCP2515; GP17 selects it; GP20 is its INT
///   UART0   GP0 sends, GP1 receives
///   TIMER   time, and end of a sleep; the watchdog resets a loop that hangs for 4 seconds

#include <cstdint>
#include <span>

#include "boards/common/clock.hpp"
#include "boards/common/cortex_m.hpp"
#include "boards/common/mcp2515.hpp"
#include "boards/common/station.hpp"

namespace cbcan::boards::pico {

inline constexpr unsigned kModbusTx = 0, kModbusRx = 1;
inline constexpr unsigned kCanMiso = 16, kCanSelect = 17, kCanClock = 18, kCanMosi = 19, kCanInterrupt = 20;

/// Access to the MCP2515.
struct CanSpi {
  void transfer(std::span<std::uint8_t> bytes) const;
};

class Board final : public Hardware {
 public:
  /// Clocks, pins, peripherals and interrupts; then init() of can(). UART0 is only for `modbus`.
  void start(RtuServer* modbus = nullptr, std::uint32_t baud = 0);

  Mcp2515<CanSpi>& can() { return can_; }
  /// Feeds the watchdog, and waits for an interrupt or until `due`, but not longer than Sleep::kLongest.
  void sleep_until(Time due);

  // Hardware.
  Time now() override;
  bool receive(std::size_t /*network*/, Frame& frame) override {
    const InterruptLock lock;  // for some 20 us
    return can_.receive(frame);
  }
  BusState bus_state(std::size_t /*network*/) override { return can_.state(); }
  void respond(std::span<const std::uint8_t> response) override;
  Health health(std::size_t network) override;

  // Interrupts.
  void on_timer();
  void on_can();
  void on_modbus();

 private:
  Mcp2515<CanSpi> can_{CanSpi()};
  Clock clock_;
  RtuServer* modbus_ = nullptr;
  std::span<const std::uint8_t> response_;  ///< the part still to be sent
  std::uint32_t modbus_lost_ = 0;
  Sleep sleep_;
};

/// The vector table of a program for the board: interrupts call `kBoard`.
using Vectors = VectorTable<32>;

template <Board& kBoard>
constexpr Vectors vectors_of() {
  Vectors vectors;
  vectors.interrupts.fill(fault_handler);
  // Numbers: RP2040 data sheet, 2.3.2.
  vectors.interrupts[0] = [] { kBoard.on_timer(); };
  vectors.interrupts[13] = [] { kBoard.on_can(); };
  vectors.interrupts[20] = [] { kBoard.on_modbus(); };
  return vectors;
}

}  // namespace cbcan::boards::pico

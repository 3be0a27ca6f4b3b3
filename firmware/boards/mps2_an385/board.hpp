// SPDX-License-Identifier: MIT
#pragma once

/// ARM MPS2 with the image AN385 (Cortex-M3, 25 MHz), as it is on the bench or in QEMU (-M mps2-an385; the
/// same program runs on mps2-an386, a Cortex-M4, and mps2-an500, a Cortex-M7):
///
///   UART0   Modbus RTU, 115200 baud, 8N1
///   UART1   SLCAN: the CAN bus, through an adapter or an emulator's socket
///   FPGAIO  time; the dual timer ends a sleep; the watchdog resets a loop that hangs for 4 seconds

#include <cstdint>
#include <span>

#include "boards/common/clock.hpp"
#include "boards/common/cortex_m.hpp"
#include "boards/common/registers.hpp"
#include "boards/common/slcan_port.hpp"
#include "boards/common/station.hpp"
#include "boards/mps2_an385/cmsdk.hpp"

namespace cbcan::boards::mps2 {

inline constexpr std::uint32_t kSystemClock = 25'000'000;  ///< Hz

/// Why the board was reset. It has no register for this, so the watchdog leaves a note in memory; without a
/// note it was power on. Clears the note.
regmap::ResetCause take_reset_cause();

/// The NMI vector, the watchdog's warning: leaves the note and resets the board.
void on_watchdog();

class Board final : public Hardware {
 public:
  struct Settings {
    std::uint32_t modbus_baud;
    std::uint32_t adapter_baud;
    std::uint16_t can_kbit_per_second;  ///< one of slcan::kBitRates
  };

  /// `cause`: of the last reset.
  Board(const Settings& settings, regmap::ResetCause cause);

  /// Interrupts on; UART0 is not used.
  void start();
  /// `modbus` gets the bytes of UART0.
  void start(RtuServer& modbus);

  CanPort& can() { return can_; }
  /// Feeds the watchdog, and waits for an interrupt or until `due`, but not longer than Sleep::kLongest.
  void sleep_until(Time due);

  // Hardware.
  Time now() override { return clock_.now(counter_.read()); }
  bool receive(std::size_t /*network*/, Frame& frame) override { return can_.receive(frame); }
  BusState bus_state(std::size_t /*network*/) override { return can_.state(); }
  void respond(std::span<const std::uint8_t> response) override;
  Health health(std::size_t network) override;

  // Interrupts.
  void on_modbus_received();
  void on_modbus_sent();
  void on_adapter_received();
  void on_adapter_sent();
  void on_timer();

 private:
  Settings settings_;
  regmap::ResetCause reset_cause_;
  Uart<Mmio> modbus_uart_{Mmio(0x40004000)};
  Uart<Mmio> adapter_uart_{Mmio(0x40005000)};
  WakeUp<Mmio> wake_up_{Mmio(0x40002000)};
  Watchdog<Mmio> watchdog_{Mmio(0x40008000)};
  MicrosecondCounter<Mmio> counter_{Mmio(0x40028000)};
  Clock clock_;
  SlcanPort can_;
  RtuServer* modbus_ = nullptr;
  std::span<const std::uint8_t> response_;  ///< the part still to be sent
  Sleep sleep_;
};

/// The vector table of a program for the board, whose interrupts call `kBoard`.
///
///   [[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors =
///   mps2::vectors_of<board>();
using Vectors = VectorTable<32>;

template <Board& kBoard, bool kHasModbus = true>
constexpr Vectors vectors_of() {
  Vectors vectors;
  vectors.nmi = on_watchdog;
  vectors.interrupts.fill(fault_handler);
  // Numbers: AN385, 3.5.
  if constexpr (kHasModbus) {
    vectors.interrupts[0] = [] { kBoard.on_modbus_received(); };
    vectors.interrupts[1] = [] { kBoard.on_modbus_sent(); };
  }
  vectors.interrupts[2] = [] { kBoard.on_adapter_received(); };
  vectors.interrupts[3] = [] { kBoard.on_adapter_sent(); };
  vectors.interrupts[10] = [] { kBoard.on_timer(); };
  return vectors;
}

}  // namespace cbcan::boards::mps2

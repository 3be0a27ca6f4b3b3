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
#include <type_traits>

#include "boards/common/clock.hpp"
#include "boards/common/cortex_m.hpp"
#include "boards/common/registers.hpp"
#include "boards/common/slcan_port.hpp"
#include "boards/common/station.hpp"

namespace cbcan::boards::mps2 {

inline constexpr std::uint32_t kSystemClock = 25'000'000;  ///< Hz

// Interrupt numbers (AN385, 3.5).
inline constexpr std::size_t kModbusReceive = 0, kModbusTransmit = 1, kAdapterReceive = 2,
                             kAdapterTransmit = 3;
inline constexpr std::size_t kTimer = 10;

/// Why the board was reset. It has no register for this, so the watchdog leaves a note in memory; without a
/// note it was power on. Clears the note.
regmap::ResetCause take_reset_cause();

/// The NMI vector, the watchdog's warning: leaves the note and resets the board.
void on_watchdog();

// The FPGA's free-running counter (AN385, 4.5), as microseconds. Unlike SysTick it needs one read, and it
// does not go backwards in QEMU.
inline constexpr Mmio kFpga{0x40028000};
inline constexpr std::uint32_t kCounter = 0x18, kPrescale = 0x1C;

/// APB UART (4.3): one byte each way, 8N1.
class Uart {
 public:
  constexpr explicit Uart(Mmio registers) : registers_(registers) {}

  /// Enables the interrupts of both directions.
  void start(std::uint32_t baud) {
    registers_.write(kDivider, kSystemClock / baud);
    registers_.write(kControl, kBothDirectionsAndInterrupts);
  }

  /// Call in the receive interrupt: calls take(byte) for each byte received.
  void on_receive_interrupt(auto take) {
    registers_.write(kInterrupt, kReceived);
    while (registers_.read(kState) & kReceiveFull)
      take(static_cast<std::uint8_t>(registers_.read(kData)));
    if (registers_.read(kState) & kReceiveOverrun) {
      registers_.write(kState, kReceiveOverrun);
      lost_ = lost_ + 1;
    }
  }

  /// Call in the transmit interrupt, which occurs after a byte was sent or when it was pended: next(byte)
  /// gives the next byte, or false when there is none.
  void on_transmit_interrupt(auto next) {
    registers_.write(kInterrupt, kTransmitted);
    std::uint8_t byte;
    while (!(registers_.read(kState) & kTransmitFull) && next(byte))
      registers_.write(kData, byte);
  }

  /// Number of overruns: a byte arrived before the previous one was read.
  std::uint32_t lost() const { return lost_; }

 private:
  static constexpr std::uint32_t kData = 0x00, kState = 0x04, kControl = 0x08, kInterrupt = 0x0C,
                                 kDivider = 0x10;
  static constexpr std::uint32_t kTransmitFull = bit(0), kReceiveFull = bit(1), kReceiveOverrun = bit(3);
  static constexpr std::uint32_t kBothDirectionsAndInterrupts = 0xF, kTransmitted = bit(0),
                                 kReceived = bit(1);

  Mmio registers_;
  volatile std::uint32_t lost_ = 0;
};

/// A node at the adapter; a coprocessor is a ModbusBoard.
class Board {
 public:
  /// `can_kbit_per_second`: one of slcan::kBitRates.
  Board(std::uint32_t adapter_baud, std::uint16_t can_kbit_per_second)
      : adapter_baud_(adapter_baud), can_(can_kbit_per_second) {}

  /// Interrupts on.
  void start();

  CanPort& can() { return can_; }
  Time now() { return clock_.now(kFpga.read(kCounter)); }
  bool receive(std::size_t /*network*/, Frame& frame) { return can_.receive(frame); }
  BusState bus_state(std::size_t /*network*/) { return can_.state(); }
  /// Feeds the watchdog, and waits for an interrupt or until `due`, but not longer than Sleep::kLongest.
  void sleep_until(Time due);

  // Interrupts.
  void on_adapter_received();
  void on_adapter_sent();
  void on_timer();

 protected:
  std::uint32_t adapter_baud_;
  Uart adapter_uart_{Mmio(0x40005000)};
  Clock clock_;
  SlcanPort can_;
  Sleep sleep_;
};

class ModbusBoard final : public Board, public Hardware {
 public:
  struct Settings {
    std::uint32_t modbus_baud, adapter_baud;
    std::uint16_t can_kbit_per_second;  ///< one of slcan::kBitRates
  };

  /// `cause`: of the last reset.
  ModbusBoard(const Settings& settings, regmap::ResetCause cause)
      : Board(settings.adapter_baud, settings.can_kbit_per_second),
        modbus_baud_(settings.modbus_baud),
        reset_cause_(cause) {}

  /// `modbus` gets the bytes of UART0.
  void start(RtuServer& modbus);

  // Hardware.
  Time now() override { return Board::now(); }
  bool receive(std::size_t network, Frame& frame) override { return Board::receive(network, frame); }
  BusState bus_state(std::size_t network) override { return Board::bus_state(network); }
  void respond(std::span<const std::uint8_t> response) override;
  Health health(std::size_t network) override;

  // Interrupts.
  void on_modbus_received();
  void on_modbus_sent();

 private:
  std::uint32_t modbus_baud_;
  regmap::ResetCause reset_cause_;
  Uart modbus_uart_{Mmio(0x40004000)};
  RtuServer* modbus_ = nullptr;
  std::span<const std::uint8_t> response_;  ///< the part still to be sent
};

/// The vector table of a program for the board, whose interrupts call `kBoard`.
///
///   [[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors =
///   mps2::vectors_of<board>();
using Vectors = VectorTable<kTimer + 1>;

template <auto& kBoard>
constexpr Vectors vectors_of() {
  Vectors vectors;
  vectors.nmi = on_watchdog;
  vectors.interrupts.fill(fault_handler);
  if constexpr (std::is_same_v<decltype(kBoard), ModbusBoard&>) {
    vectors.interrupts[kModbusReceive] = [] { kBoard.on_modbus_received(); };
    vectors.interrupts[kModbusTransmit] = [] { kBoard.on_modbus_sent(); };
  }
  vectors.interrupts[kAdapterReceive] = [] { kBoard.on_adapter_received(); };
  vectors.interrupts[kAdapterTransmit] = [] { kBoard.on_adapter_sent(); };
  vectors.interrupts[kTimer] = [] { kBoard.on_timer(); };
  return vectors;
}

}  // namespace cbcan::boards::mps2

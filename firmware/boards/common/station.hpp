// SPDX-License-Identifier: MIT
#pragma once

/// What every board runs: the PLC's registers, a Modbus RTU server in front of them, the coprocessor behind
/// them, and the diagnostics registers (docs/registers.md). A board's program is
///
///   station.start();
///   for (;;) sleep_until(station.turn());
///
/// where sleep_until() returns early after any interrupt. Interrupts hand bytes to modbus().on_byte() and
/// frames to whatever Hardware::receive() reads; everything else happens in turn(). So a Modbus request is
/// applied whole between two polls of the coprocessor, and its answer shows a window with results before the
/// flag.

#include <cstdint>
#include <span>

#include "boards/common/hardware.hpp"
#include "coprocessor/coprocessor.hpp"
#include "modbus/rtu_server.hpp"

namespace cbcan::boards {

class Station {
 public:
  /// R0..R4167; the board's memory, zeros at the start.
  using Registers = std::span<std::uint16_t, regmap::kRegisterFileWords>;

  struct Settings {
    std::uint8_t station = 1;     ///< Modbus station address, 1..247
    std::uint32_t gap_us = 1750;  ///< see RtuServer::Settings
    Coprocessor::Settings coprocessor;
  };

  /// All live as long as the station.
  Station(Registers registers, Hardware& hardware, CanPort& port, const Settings& settings);

  RtuServer& modbus() { return modbus_; }
  const Coprocessor& coprocessor() const { return coprocessor_; }

  /// Sends the boot-up message.
  void start() { coprocessor_.start(hardware_.now()); }

  /// Takes what has arrived, executes at most one Modbus request, and does what is due. Returns the time of
  /// the next turn at the latest; kNever = only after an interrupt.
  Time turn();

 private:
  void publish(Time now);
  void put(std::uint16_t address, std::uint32_t value);

  Registers registers_;
  Hardware& hardware_;
  RtuServer modbus_;
  Coprocessor coprocessor_;
};

}  // namespace cbcan::boards

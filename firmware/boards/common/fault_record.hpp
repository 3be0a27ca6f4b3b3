// SPDX-License-Identifier: MIT
#pragma once

/// Faults and resets by the watchdog, told over resets: in memory that start-up code leaves as it is (section
/// ".noinit"), with a check word, as after power on there is anything in it. Shown by R4133..R4139.

#include <cstdint>

#include "boards/common/station.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"

namespace cbcan::boards {

class FaultRecord {
 public:
  struct Fault {
    std::uint32_t pc;
    std::uint32_t lr;
    std::uint32_t status;
  };

  /// After this time without one more, faults are no longer in a row.
  static constexpr Time kGoodAfter = 300 * kSecond;
  static constexpr Time kLongestWait = 64 * kSecond;

  /// Once after each reset, with its cause.
  void start(regmap::ResetCause cause);
  /// In the fault handler, which resets the board then.
  void note(const Fault& fault);
  /// The board has run for kGoodAfter.
  void on_good() { set(fault_, count_, 0); }

  /// How long the board is to stay off the CAN bus: 1 s after a fault, after each one more in a row twice as
  /// long, kLongestWait at most.
  Time can_wait() const;
  bool in_a_row() const { return in_a_row_ != 0; }
  /// Into the registers; they change with resets alone.
  void show(Diagnostics registers) const;

 private:
  std::uint32_t sum() const;
  void set(const Fault& fault, std::uint16_t count, std::uint16_t in_a_row);

  // No initial values: it is what the reset has left.
  Fault fault_;
  std::uint16_t count_;  ///< since power on
  std::uint16_t in_a_row_;
  std::uint32_t check_;
};

}  // namespace cbcan::boards

// SPDX-License-Identifier: MIT
#pragma once

/// Records faults and watchdog resets across resets, in memory that start-up code does not touch (section
/// ".noinit"). A check word detects the random content after power on. Shown in R4133..R4139.

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

  /// Time without a fault that ends the count of faults in a row.
  static constexpr Time kGoodAfter = 300 * kSecond;

  /// Call once after each reset, with its cause.
  void start(regmap::ResetCause cause);
  /// Call in the fault handler before it resets the board.
  void note(const Fault& fault);
  /// Call when the board has run for kGoodAfter.
  void on_good() { set(fault_, count_, 0); }

  /// How long the board stays off the CAN bus: 1 s after a fault, doubled for each further one in a row, at
  /// most 64 s.
  Time can_wait() const;
  bool in_a_row() const { return in_a_row_ != 0; }
  /// Writes the registers, which change only with a reset.
  void show(Diagnostics registers) const;

 private:
  std::uint32_t sum() const;
  void set(const Fault& fault, std::uint16_t count, std::uint16_t in_a_row);

  // No initial values: the content survives a reset.
  Fault fault_;
  std::uint16_t count_;  ///< since power on
  std::uint16_t in_a_row_;
  std::uint32_t check_;
};

}  // namespace cbcan::boards

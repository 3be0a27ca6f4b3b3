// SPDX-License-Identifier: MIT
#pragma once

/// Velocity mode of frequency inverters (6060h = 2, "vl"): 6042h, scaled by 604Bh, with an amount between
/// those of 6046h, and the ramps 6048h and 6049h. Velocities are 1/min of the motor, scaled by 604Ch.
///
/// Controlword bits 4, 5, 6: the motor follows the ramp, the ramp moves, the ramp goes to 6042h. Without bit
/// 4 the motor stops with 604Ah; without bit 5 it keeps its velocity; without bit 6 the ramp goes to 0. Many
/// inverters ignore these bits: until one of them has been 1, all are taken as 1. Halt (605Dh) and quick stop
/// use 6049h and 604Ah. The mode has no statusword bits except bit 11.

#include <optional>

#include "devices/drive/profile_velocity.hpp"

namespace cbcan::devices {

class Velocity final : public VelocityMode {
 public:
  using VelocityMode::VelocityMode;

  /// Power-on.
  void reset() { has_ramp_bits_ = false; }
  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  std::uint16_t status(Time now) const override { return limit_bit(now); }

  /// Updates 6043h and 6044h.
  void show(double demand, double actual);

 private:
  double within_amounts(double velocity) const;
  double factor() const;

  bool has_ramp_bits_ = false;    ///< one of them has been 1
  std::optional<double> locked_;  ///< while bit 5 is 0, increments/s
};

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// Modes in which the axis runs at a velocity, with ramps that take effect when they change. At a software
/// position limit the axis stops until a velocity in the other direction is set.

#include <optional>

#include "devices/drive/mode.hpp"

namespace cbcan::devices {

class VelocityMode : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& /*input*/, Time /*now*/) override { plan_.reset(); }
  void resume(Time /*now*/) override { plan_.reset(); }

 protected:
  /// Everything that the profile depends on.
  struct Plan {
    Dynamics dynamics;  ///< with a velocity of 0
    double velocity = 0;
    double limit = 0;
    std::optional<Ramp> stop;  ///< by command
    bool barred = false;
    bool operator==(const Plan&) const = default;
  };

  /// Moves to `wanted`, in increments/s, at most the greatest velocity.
  void run_at(double wanted, const Dynamics& dynamics, std::optional<Ramp> stop, const ModeInput& input,
              Time now);
  /// Statusword bit 11.
  std::uint16_t limit_bit(Time now) const;

  std::optional<Plan> plan_;  ///< set by run_at()
};

/// Profile velocity (6060h = 3): 60FFh with the ramps 6083h and 6084h.
class ProfileVelocity final : public VelocityMode {
 public:
  using VelocityMode::VelocityMode;

  void run(const ModeInput& input, Time now) override;
  std::uint16_t status(Time now) const override;
  Time deadline(Time now) const override;

 private:
  bool steady(Time now, std::uint16_t for_milliseconds) const;
};

/// Runs the axis at `velocity`, up to the software position limit if there is one. False = it is already at
/// the limit or beyond.
bool run_within_limits(Axis& axis, double velocity, const Dynamics& dynamics, Time now);

/// Velocity mode of frequency inverters (6060h = 2, "vl"): 6042h, scaled by 604Bh, with an amount between
/// those of 6046h, and the ramps 6048h and 6049h. Velocities are 1/min of the motor, scaled by 604Ch.
///
/// Controlword bits 4, 5, 6: the motor follows the ramp, the ramp moves, the ramp goes to 6042h. Without bit
/// 4 the motor stops with 604Ah; without bit 5 it keeps its velocity; without bit 6 the ramp goes to 0. Many
/// inverters ignore these bits: until one of them has been 1, all are taken as 1. Halt (605Dh) and quick stop
/// use 6049h and 604Ah. The mode has no statusword bits except bit 11.
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
  double factor() const { return objects_.vl_set_point_factor.value(); }

  bool has_ramp_bits_ = false;    ///< one of them has been 1
  std::optional<double> locked_;  ///< while bit 5 is 0, increments/s
};

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// Profile velocity mode (6060h = 3): 60FFh with the ramps 6083h and 6084h, which take effect when they change.
/// At a software position limit the axis stops until a velocity in the other direction is set.

#include <optional>

#include "devices/drive/mode.hpp"

namespace cbcan::devices {

class ProfileVelocity final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& /*input*/, Time /*now*/) override { plan_.reset(); }
  void run(const ModeInput& input, Time now) override;
  void resume(Time /*now*/) override { plan_.reset(); }
  std::uint16_t status(Time now) const override;
  Time deadline(Time now) const override;

 private:
  /// Everything that the profile depends on.
  struct Plan {
    Dynamics dynamics;
    double velocity = 0;
    double limit = 0;
    bool halted = false;
    bool barred = false;
    bool operator==(const Plan&) const = default;
  };

  bool steady(Time now, std::uint16_t for_milliseconds) const;

  std::optional<Plan> plan_;  ///< set by run()
};

/// Runs the axis at `velocity`, up to the software position limit if there is one. False = it is already at the
/// limit or beyond.
bool run_within_limits(Axis& axis, double velocity, const Dynamics& dynamics, Time now);

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// The machine that a drive moves, as the plant file describes it.

#include <optional>

namespace cbcan::devices {

/// What the motor moves, as seen at its shaft. Without inertia there is no load: the axis follows its demand
/// exactly, and no torque moves it.
struct AxisLoad {
  double inertia = 0;   ///< kg cm2, with the motor's own; 0 = no load
  double friction = 0;  ///< mNm, against every motion, and holding
  double gravity = 0;   ///< mNm, towards negative positions; below 0 towards positive ones
  bool operator==(const AxisLoad&) const = default;
};

/// Where the switches are, in increments from where the axis stands at power-on. Switches at an end are
/// active from there on outwards, the home switch from home_low to home_high; hard stops are `stops_beyond`
/// further out than the limit switches. Without a limit switch there is neither on that side; homing to it
/// takes it to be kFarEnd away. The encoder gives an index pulse at 0 and every motor revolution (608Fh).
struct AxisLayout {
  static constexpr double kFarEnd = 1'000'000;

  std::optional<double> negative_limit{};
  std::optional<double> positive_limit{};
  double home_low = 200'000;
  double home_high = 250'000;
  double stops_beyond = 50'000;
  AxisLoad load = {};

  /// The ends as homing finds them.
  double negative_end() const { return negative_limit.value_or(-kFarEnd); }
  double positive_end() const { return positive_limit.value_or(kFarEnd); }
  bool operator==(const AxisLayout&) const = default;
};

}  // namespace cbcan::devices

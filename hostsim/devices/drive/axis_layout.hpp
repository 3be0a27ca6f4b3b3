// SPDX-License-Identifier: MIT
#pragma once

/// The machine moved by a drive, as the plant file describes it.

#include <cstddef>
#include <optional>

namespace cbcan::devices {

inline constexpr std::size_t kMostAxes = 8;  ///< of a node

/// The load at the motor shaft. Without inertia there is no load: the axis follows its demand exactly, and
/// torque does not move it.
struct AxisLoad {
  double inertia = 0;   ///< kg cm2, including the motor's own; 0 = no load
  double friction = 0;  ///< mNm, static and sliding
  double gravity = 0;   ///< mNm, towards negative positions; a negative value: towards positive positions
  bool operator==(const AxisLoad&) const = default;
};

/// Positions of the switches, in increments from the power-on position. A limit switch is active from its
/// position outwards, the home switch from home_low to home_high. Hard stops are `stops_beyond` outside the
/// limit switches. A side without a limit switch has no hard stop either; homing then assumes the switch at
/// kFarEnd. The encoder gives an index pulse at 0 and every motor revolution (608Fh).
struct AxisLayout {
  static constexpr double kFarEnd = 1'000'000;

  std::optional<double> negative_limit{};
  std::optional<double> positive_limit{};
  double home_low = 200'000;
  double home_high = 250'000;
  double stops_beyond = 50'000;
  AxisLoad load = {};

  /// The limit switches as homing assumes them.
  double negative_end() const { return negative_limit.value_or(-kFarEnd); }
  double positive_end() const { return positive_limit.value_or(kFarEnd); }
  bool operator==(const AxisLayout&) const = default;
};

}  // namespace cbcan::devices

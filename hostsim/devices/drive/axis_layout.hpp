// SPDX-License-Identifier: MIT
#pragma once

/// The machine moved by a drive, as the plant file describes it.

#include <array>
#include <cstddef>
#include <cstdint>
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

/// What positions and velocities of the controller are in, where the file does not say so.
enum class PositionUnit : std::uint8_t { kIncrement, kRevolution, kDegree };
enum class VelocityUnit : std::uint8_t { kIncrement, kRevolution, kRevolutionPerMinute, kDegree };
inline constexpr std::array<std::uint32_t, 3> kPositionUnits{0x00B50000, 0x00B40000, 0x00410000};
inline constexpr std::array<std::uint32_t, 4> kVelocityUnits{0x00B50300, 0x00B40300, 0x00B44700, 0x00410300};

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
  std::optional<PositionUnit> position_unit{};
  std::optional<VelocityUnit> velocity_unit{};

  /// A value of 60A8h, of 60A9h; 0 = not given.
  std::uint32_t si_position() const {
    return position_unit ? kPositionUnits[static_cast<std::size_t>(*position_unit)] : 0;
  }
  std::uint32_t si_velocity() const {
    return velocity_unit ? kVelocityUnits[static_cast<std::size_t>(*velocity_unit)] : 0;
  }
  /// The limit switches as homing assumes them.
  double negative_end() const { return negative_limit.value_or(-kFarEnd); }
  double positive_end() const { return positive_limit.value_or(kFarEnd); }
  bool operator==(const AxisLayout&) const = default;
};

}  // namespace cbcan::devices

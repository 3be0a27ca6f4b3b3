// SPDX-License-Identifier: MIT
#pragma once

/// User-defined units against increments of the position encoder (CiA 402: 608Fh, 6091h, 6092h):
///
///   increments = user * (608Fh:1 * 6091h:1 * 6092h:2) / (608Fh:2 * 6091h:2 * 6092h:1)

#include <cstdint>
#include <limits>

namespace cbcan::devices {

/// As they stand in the dictionary. A ratio with a 0 in it counts as 1:1.
struct UnitFactors {
  std::uint32_t encoder_increments = 1;
  std::uint32_t encoder_revolutions = 1;
  std::uint32_t gear_motor_revolutions = 1;
  std::uint32_t gear_shaft_revolutions = 1;
  std::uint32_t feed = 1;
  std::uint32_t feed_shaft_revolutions = 1;
  bool operator==(const UnitFactors&) const = default;
};

class Units {
 public:
  constexpr Units() = default;
  explicit constexpr Units(const UnitFactors& factors) {
    take(factors.encoder_increments, factors.encoder_revolutions);
    increments_per_revolution_ = up_ / down_;
    take(factors.gear_motor_revolutions, factors.gear_shaft_revolutions);
    take(factors.feed_shaft_revolutions, factors.feed);
  }

  /// The same factor for positions, velocities (per second) and accelerations (per second squared). Products
  /// up to 2^53 are exact and are divided once.
  constexpr double increments(double user) const { return user * up_ / down_; }
  constexpr double user(double increments) const { return increments * down_ / up_; }
  constexpr double increments_per_revolution() const { return increments_per_revolution_; }

 private:
  constexpr void take(std::uint32_t up, std::uint32_t down) {
    if (up == 0 || down == 0) return;
    up_ *= up;
    down_ *= down;
  }

  double up_ = 1;
  double down_ = 1;
  double increments_per_revolution_ = 1;
};

/// The nearest INTEGER32, halves away from 0; what lies outside is the nearest there is.
inline std::int32_t to_integer32(double value) {
  constexpr double kLowest = std::numeric_limits<std::int32_t>::min();
  constexpr double kHighest = std::numeric_limits<std::int32_t>::max();
  if (!(value > kLowest)) return std::numeric_limits<std::int32_t>::min();
  if (value >= kHighest) return std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(value < 0 ? value - 0.5 : value + 0.5);
}

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// Conversion of user-defined units to increments of the position encoder. The first of the following that
/// the file has and that is not 1 : 1 applies.
///
/// Positions: 6093h, increments = user * 6093h:1 / 6093h:2; or with a feed constant (6092h)
///
///   increments = user * (608Fh:1 * 6091h:1 * 6092h:2) / (608Fh:2 * 6091h:2 * 6092h:1)
///
/// or the unit in 60A8h: increments, revolutions of the shaft, degrees. With none of them and no 6093h, the
/// formula with a feed of 1.
///
/// Velocities, per second: 6094h, increments = user * 6094h:1 / 6094h:2; 6096h, user units = position units *
/// 6096h:1 / 6096h:2; the unit in 60A9h; position units. Accelerations are velocity units per second.

#include <cstdint>

namespace cbcan::devices {

/// Values as in the dictionary; a ratio with a 0 is ignored.
struct Ratio {
  std::uint32_t up = 0;
  std::uint32_t down = 0;
  bool operator==(const Ratio&) const = default;

  constexpr bool counts() const { return up != 0 && down != 0; }
  constexpr bool is_other_than_1() const { return counts() && up != down; }
};

struct UnitFactors {
  Ratio encoder{};                ///< 608Fh: increments, motor revolutions
  Ratio gear{};                   ///< 6091h: motor revolutions, shaft revolutions
  Ratio feed{};                   ///< 6092h: feed, shaft revolutions
  Ratio position{};               ///< 6093h
  Ratio velocity_encoder{};       ///< 6094h
  Ratio velocity{};               ///< 6096h
  std::uint32_t si_position = 0;  ///< 60A8h
  std::uint32_t si_velocity = 0;  ///< 60A9h
  bool operator==(const UnitFactors&) const = default;
};

class Units {
 public:
  constexpr Units() = default;
  explicit Units(const UnitFactors& factors);

  /// Products up to 2^53 are exact and are divided once.
  double increments(double user) const { return user * position_.up / position_.down; }
  double user(double increments) const { return increments * position_.down / position_.up; }
  /// Conversions of velocities (per second) and accelerations (per second squared).
  double increments_per_second(double user) const { return user * velocity_.up / velocity_.down; }
  double user_velocity(double increments) const { return increments * velocity_.down / velocity_.up; }

  /// Increments of the motor; kNominalResolution if 608Fh gives none.
  double increments_per_revolution() const { return increments_per_revolution_; }
  /// Motor speeds can be converted to velocities: 608Fh or 60A9h refers to revolutions.
  bool knows_revolutions() const { return knows_revolutions_; }

  static constexpr double kNominalResolution = 2000;

 private:
  struct Factor {
    double up = 1;
    double down = 1;
    constexpr Factor times(double by_up, double by_down) const { return {up * by_up, down * by_down}; }
    constexpr Factor times(const Ratio& by) const { return by.counts() ? times(by.up, by.down) : *this; }
    Factor times_ten_to(int exponent) const;
  };

  /// Increments in one unit of 60A8h or 60A9h; up = 0: not a unit of rotation.
  static Factor size_of(std::uint32_t unit, const Factor& shaft);
  Factor velocity_of(const UnitFactors& factors, const Factor& shaft);

  Factor position_{};
  Factor velocity_{};
  double increments_per_revolution_ = kNominalResolution;
  bool knows_revolutions_ = false;
};

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// Units of a drive, and its motion in them.

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/time.hpp"

namespace cbcan::devices {

/// Values as in the dictionary; a ratio with a 0 is ignored.
struct Ratio {
  std::uint32_t up = 0;
  std::uint32_t down = 0;
  bool operator==(const Ratio&) const = default;

  constexpr bool counts() const { return up != 0 && down != 0; }
  constexpr bool is_other_than_1() const { return counts() && up != down; }
};

/// A unit of DSP 402 V2: 6089h and 608Ah, or 608Bh and 608Ch.
struct NamedDimension {
  std::int8_t notation = 0;  ///< power of ten
  std::uint8_t dimension = 0;
  bool operator==(const NamedDimension&) const = default;
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
  // Where these are 0.
  NamedDimension older_position{}, older_velocity{};
  // Where the file says nothing, as in 60A8h and 60A9h.
  std::uint32_t position_of_plant = 0, velocity_of_plant = 0;
  bool operator==(const UnitFactors&) const = default;
};

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
class Units {
 public:
  constexpr Units() = default;
  explicit Units(const UnitFactors& given);

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

struct Motion {
  double position = 0;
  double velocity = 0;
};

/// Limits are not negative. An acceleration or deceleration of 0 means without a ramp; a velocity of 0 means
/// no motion.
struct Dynamics {
  double velocity = 0;
  double acceleration = 0;
  double deceleration = 0;
  bool operator==(const Dynamics&) const = default;
};

/// Motion in closed form: at most four phases of constant acceleration, then a constant velocity without end.
/// Position and velocity at any time are calculated, not accumulated, so the result does not depend on when
/// or how often they are read. Positions in increments, velocities in increments/s, accelerations in
/// increments/s^2, all double: exact for whole increments up to 2^53. The end is rounded up to the next
/// microsecond; from then on position and velocity are exactly the requested ones.
class Profile {
 public:
  /// A profile at rest.
  explicit Profile(double position = 0) { finish(position, 0); }

  /// The shortest trapezoid from the motion at `start` to a standstill at `target`: |v| never exceeds the
  /// allowed velocity, or the initial velocity if that is greater. An axis that cannot stop in time passes
  /// the target, reverses and returns.
  static Profile to_position(const Motion& from, double target, const Dynamics& dynamics, Time start);

  /// A ramp to a velocity, which is then kept; via standstill if the direction changes.
  static Profile to_velocity(const Motion& from, double velocity, double acceleration, double deceleration,
                             Time start);

  /// Moves at constant velocity to `target` within `duration`, then at rest.
  static Profile line(double from, double target, Time duration, Time start);

  /// The velocity changes linearly to `velocity` within `duration` and is then kept.
  static Profile even_change(const Motion& from, double velocity, Time duration, Time start);

  /// `now` not before the start. The last result is kept: callers read the same time repeatedly.
  Motion at(Time now) const {
    if (now != known_at_) know(now);
    return known_;
  }

  /// When the last phase, of constant velocity, begins.
  Time end() const { return end_; }
  /// When the next phase begins, after `now`; kNever = none.
  Time next_change(Time now) const;
  /// Time since which the velocity has been constant; kNever = it is changing.
  Time steady_since(Time now) const;
  /// The velocity after the end.
  double final_velocity() const { return phases_[count_ - 1].velocity; }

  /// Bounds of the position; infinite for a motion with accelerations or without an end.
  struct Range {
    double low;
    double high;
  };
  Range range() const;
  /// The first time, at `from` or later, at which `position` is reached or has been passed; kNever = never.
  Time time_at(double position, Time from) const;

  /// Moves the origin of the coordinates.
  void shift(double distance);

 private:
  struct Phase {
    Time begins;   ///< the first microsecond in the phase
    double begin;  ///< seconds after the start
    double position;
    double velocity;
    double acceleration;
  };

  Profile(const Motion& from, Time start) : start_(start), last_(from) {}
  void travel(double target, const Dynamics& dynamics);
  void append(double duration, double acceleration, double end_velocity);
  void finish(double position, double velocity);
  double seconds_at(Time now) const;
  std::size_t phase_at(Time now) const;
  void know(Time now) const;
  double first_reach(const Phase& phase, double position, double from, double until) const;

  std::array<Phase, 5> phases_{};
  std::size_t count_ = 0;
  Time start_ = 0;
  Time end_ = 0;
  double length_ = 0;               ///< seconds
  Motion last_{};                   ///< end of the phases so far
  mutable Time known_at_ = kNever;  ///< at(known_at_) is known_
  mutable Motion known_{};
};

}  // namespace cbcan::devices

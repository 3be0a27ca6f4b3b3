// SPDX-License-Identifier: MIT
#pragma once

/// Motion in closed form: at most four stretches of constant acceleration, then a constant velocity for ever.
/// Position and velocity at any time are calculated, not accumulated, so it does not matter when or how often
/// anybody looks. Positions in increments, velocities in increments/s, accelerations in increments/s^2, all
/// double: exact for whole increments up to 2^53. The end is rounded up to the next microsecond; from then on
/// position and velocity are exactly those that were asked for.

#include <array>
#include <cstddef>

#include "cbcan/time.hpp"

namespace cbcan::devices {

struct Motion {
  double position = 0;
  double velocity = 0;
};

/// Not negative. An acceleration or deceleration of 0 is taken as "at once"; a velocity of 0 does not get
/// anywhere.
struct Dynamics {
  double velocity = 0;
  double acceleration = 0;
  double deceleration = 0;
  bool operator==(const Dynamics&) const = default;
};

class Profile {
 public:
  /// At rest.
  explicit Profile(double position = 0) { finish(position, 0); }

  /// The shortest trapezoid from where and how the axis moves at `start` to a standstill at `target`: |v| is
  /// never greater than the velocity allowed, or than it was at the start. Who cannot stop in time passes the
  /// target, reverses and comes back.
  static Profile to_position(const Motion& from, double target, const Dynamics& dynamics, Time start);

  /// A ramp to a velocity, which is then kept; through standstill if the direction changes.
  static Profile to_velocity(const Motion& from, double velocity, double acceleration, double deceleration,
                             Time start);

  /// In a straight line to `target` within `duration`, then at rest.
  static Profile line(double from, double target, Time duration, Time start);

  /// The velocity changes evenly to `velocity` within `duration` and is then kept.
  static Profile even_change(const Motion& from, double velocity, Time duration, Time start);

  /// `now` not before the start. Asked many times for each.
  Motion at(Time now) const {
    if (now != known_at_) know(now);
    return known_;
  }

  /// When the last stretch begins, that of constant velocity.
  Time end() const { return end_; }
  /// When the next stretch begins, after `now`; kNever = none does.
  Time next_change(Time now) const;
  /// Since when the velocity has been what it is; kNever = it is changing.
  Time steady_since(Time now) const;
  /// The velocity after the end.
  double final_velocity() const { return phases_[count_ - 1].velocity; }

  /// Positions that it never leaves; those of a motion with accelerations, or without an end, are not looked
  /// for.
  struct Range {
    double low;
    double high;
  };
  Range range() const;
  /// The first time, at `from` or later, at which `position` is reached or has been passed; kNever = not.
  Time time_at(double position, Time from) const;

  /// The same motion in coordinates that lie elsewhere.
  void shift(double distance);

 private:
  struct Phase {
    Time begins;   ///< the first microsecond in it
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
  Motion last_{};                   ///< while it is being put together
  mutable Time known_at_ = kNever;  ///< at() then is known_
  mutable Motion known_{};
};

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// Motion in closed form: at most four phases of constant acceleration, then a constant velocity without end.
/// Position and velocity at any time are calculated, not accumulated, so the result does not depend on when
/// or how often they are read. Positions in increments, velocities in increments/s, accelerations in
/// increments/s^2, all double: exact for whole increments up to 2^53. The end is rounded up to the next
/// microsecond; from then on position and velocity are exactly the requested ones.

#include <array>
#include <cstddef>

#include "cbcan/time.hpp"

namespace cbcan::devices {

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

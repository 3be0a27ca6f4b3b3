// SPDX-License-Identifier: MIT
#pragma once

/// A load at the motor shaft and its position controller: inertia, torque, friction, gravity, hard stops. It
/// is calculated in steps of whole milliseconds, so the result does not depend on how often it is read.
/// Positions are increments, torques thousandths of the rated torque (6076h, mNm).
///
/// The controller compensates friction and gravity and derives acceleration from the following error: the
/// axis lags by acceleration / (188 rad/s)^2, and by more if the torque is limited.

#include "cbcan/time.hpp"
#include "devices/drive/axis_layout.hpp"
#include "devices/drive/profile.hpp"

namespace cbcan::devices {

class Load {
 public:
  /// What moves the load. Without demand and torque, the motor makes no torque.
  struct Lead {
    const Profile* demand = nullptr;  ///< of position; null = none
    const Profile* torque = nullptr;  ///< its velocity is the torque; null = none
    bool held = false;                ///< by a brake
    double most_torque = 0;           ///< in either direction
    double low = 0;                   ///< hard stops
    double high = 0;
  };

  explicit Load(const AxisLoad& load) : load_(load) {}
  bool exists() const { return load_.inertia > 0; }

  /// Begins at rest here. `per_radian`: increments; `rated`: mNm.
  void reset(double position, Time now);
  void set_units(double per_radian, double rated) { per_radian_ = per_radian, rated_ = rated; }

  /// Calculates up to the last whole millisecond not after `now`.
  void follow(const Lead& lead, Time now);
  /// The demand, torque or brake has changed.
  void wake() { settled_ = false; }
  void shift(double distance) { position_ += distance; }

  Motion at(Time now) const;
  /// State at the last whole millisecond: decisions based on it do not depend on when it is read.
  double position() const { return position_; }
  double torque() const { return torque_; }
  /// The controller demands more torque than is allowed.
  bool is_limited() const { return limited_; }
  /// kNever = the load is at rest.
  Time next_change(Time now) const;

 private:
  void step(const Lead& lead);
  double wanted_torque(const Lead& lead, Time end) const;
  double acceleration(double torque) const;
  bool rests(const Lead& lead, Time end) const;
  double thousandths(double torque) const { return 1000 * torque / rated_; }

  AxisLoad load_;
  double per_radian_ = 1;
  double rated_ = 1;
  double position_ = 0;
  double velocity_ = 0;
  double torque_ = 0;
  Time at_ = 0;
  bool settled_ = false;
  bool limited_ = false;
};

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// A load at the motor's shaft, and the controller that makes it follow: inertia against torque, friction,
/// gravity, hard stops. It is calculated from one whole millisecond to the next, whenever somebody looks, so
/// nothing depends on how often that is. Positions are increments, torques thousandths of the rated one
/// (6076h, mNm).
///
/// The controller holds against friction and gravity by itself and takes acceleration from the following
/// error: the axis lags by acceleration / (188 rad/s)^2, and by more where the torque is limited.

#include "cbcan/time.hpp"
#include "devices/drive/axis_layout.hpp"
#include "devices/drive/profile.hpp"

namespace cbcan::devices {

class Load {
 public:
  /// What moves it from now on.
  struct Lead {
    const Profile* demand = nullptr;  ///< of position; null: none
    const Profile* torque =
        nullptr;             ///< its velocity is the torque; null with none of the two = no torque at all
    bool held = false;       ///< by a brake
    double most_torque = 0;  ///< either way
    double low = 0;          ///< hard stops
    double high = 0;
  };

  explicit Load(const AxisLoad& load) : load_(load) {}
  bool exists() const { return load_.inertia > 0; }

  /// At rest here. `per_radian`: increments; `rated`: mNm.
  void reset(double position, Time now);
  void set_units(double per_radian, double rated) { per_radian_ = per_radian, rated_ = rated; }

  /// Goes on to the last whole millisecond by `now`.
  void follow(const Lead& lead, Time now);
  /// Something that it follows has changed.
  void wake() { settled_ = false; }
  void shift(double distance) { position_ += distance; }

  Motion at(Time now) const;
  /// At the last whole millisecond: what is decided by this does not depend on who looks when.
  double position() const { return position_; }
  double torque() const { return torque_; }
  /// The controller would have more torque than there is.
  bool is_limited() const { return limited_; }
  /// kNever: nothing changes by itself.
  Time next_change(Time now) const;

 private:
  void step(const Lead& lead);
  double wanted_torque(const Lead& lead, Time end) const;
  double acceleration(double torque) const;
  bool rests(const Lead& lead) const;
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

// SPDX-License-Identifier: MIT
#pragma once

/// One axis of a drive, and a load at its motor.

#include <cstdint>

#include "cbcan/time.hpp"
#include "devices/drive/axis_layout.hpp"
#include "devices/drive/objects.hpp"
#include "devices/drive/profile.hpp"

namespace cbcan::devices {

/// A load at the motor shaft and its position controller: inertia, torque, friction, gravity, hard stops. It
/// is calculated in steps of whole milliseconds, so the result does not depend on how often it is read.
/// Positions are increments, torques thousandths of the rated torque (6076h, mNm).
///
/// The controller compensates friction and gravity and derives acceleration from the following error: the
/// axis lags by acceleration / (188 rad/s)^2, and by more if the torque is limited.
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

/// Which switches are active.
struct AxisSwitches {
  bool negative_limit = false;
  bool positive_limit = false;
  bool home = false;
};

/// The ramps that option codes 605Ah..605Eh choose.
enum class Ramp : std::uint8_t {
  kSlowDown,   ///< profile deceleration, 6084h; in velocity mode 6049h
  kQuickStop,  ///< quick stop deceleration, 6085h; in velocity mode 604Ah
};

/// One axis: motor, encoder and the driven mechanics. It follows the profile exactly, unless the motor is
/// blocked or has a load. Positions are increments from the zero of position, which homing sets.
/// Switches are at machine coordinates (called places), which homing does not change.
///
/// Without power, the axis decelerates at 6085h (quick stop), or by friction if it has a load.
class Axis {
 public:
  Axis(DriveObjects& objects, const AxisLayout& layout)
      : objects_(objects), layout_(layout), load_(layout.load) {}

  /// Power-on: at rest; the current position becomes 0.
  void reset(Time now);

  /// Applies changed units and wraps the position into its range (607Bh, else INTEGER32).
  void refresh(Time now);

  // Motion. Each starts now, from the current motion.
  void move_to(double target, const Dynamics& dynamics, Time now);
  void run_at(double velocity, double acceleration, double deceleration, Time now);
  void line_to(double target, Time duration, Time now);
  void change_evenly_to(double velocity, Time duration, Time now);
  void stop(Ramp ramp, Time now) { run_at(0, 0, deceleration(ramp), now); }
  /// Sets the target without starting a motion.
  void aim_at(double target) { target_ = target; }
  /// Sets the demand to the actual position, at rest, when a profile is abandoned.
  void give_up_demand(Time now);

  Motion demand(Time now) const { return led_ ? profile_.at(now) : load_.at(now); }
  Motion actual(Time now) const {
    if (blocked_) return {blocked_at_, 0};
    return load_.exists() ? load_.at(now) : profile_.at(now);
  }
  /// The actual position for decisions: that of a load does not depend on when it is read.
  double place(Time now) const {
    return to_machine(load_.exists() && !blocked_ ? load_.position() : actual(now).position);
  }
  const Profile& profile() const { return profile_; }
  bool over(Time now) const { return now >= profile_.end(); }
  /// It follows the profile within its position range: no wrap on the way.
  bool just_moves() const;
  /// The profile has ended at standstill.
  bool at_rest(Time now) const { return over(now) && profile_.final_velocity() == 0; }
  /// The target last given to move_to(), line_to() or aim_at().
  double target() const { return target_; }

  /// A blocked motor stays at its position. When released, it starts from there.
  void set_blocked(bool blocked, Time now);
  bool blocked() const { return blocked_; }

  // The load, if any.
  const Load& load() const { return load_; }
  /// Calculates the load up to `now`; call it before anything that the load follows changes.
  void carry(Time now) {
    if (load_.exists()) load_.follow(lead(), now);
  }
  /// Sets, for an axis with a load, from now on: power on or off, and the torque profile to follow; null =
  /// follow positions.
  void drive(bool powered, const Profile* torque, Time now);
  /// Limit in either direction: the smaller of max torque (6072h) and max current (6073h), which is
  /// proportional to torque.
  double most_torque() const;

  // Values of objects, in increments.
  Dynamics profile_dynamics() const;
  double max_velocity() const;
  /// Units of velocity mode: 1/min of the motor, scaled by 604Ch.
  double from_vl(double velocity) const;
  double to_vl(double increments_per_second) const { return increments_per_second / from_vl(1); }
  double slope(const DriveObjects::Slope& slope) const;
  /// Clamped to the software position limits (607Dh), which apply if the lower is below the upper.
  double within_limits(double position) const;
  bool has_limits() const { return objects_.limit_min.get() < objects_.limit_max.get(); }
  /// The actual position, as 6064h shows it, is outside these limits.
  bool is_outside_limits(Time now) const;
  double increments(double user) const { return units_.increments(user); }
  double user(double increments) const { return units_.user(increments); }
  double increments_per_second(double user) const { return units_.increments_per_second(user); }
  double user_velocity(double increments) const { return units_.user_velocity(increments); }

  // The machine.
  /// A rotary axis (607Bh narrower than INTEGER32) has no ends.
  bool goes_round() const;
  AxisSwitches switches(Time now) const;
  /// The first time after `now` at which the profile reaches `position`; kNever = never.
  Time passes(double position, Time now) const;
  /// When a switch may change next; kNever = never.
  Time next_switch(Time now) const;
  const AxisLayout& layout() const { return layout_; }
  double to_machine(double position) const { return position - zero_; }
  double from_machine(double place) const { return place + zero_; }
  /// Distance around a rotary axis.
  double circumference() const;
  double index_pitch() const { return units_.increments_per_revolution(); }
  /// The demanded position is called `position` from now on.
  void set_position(double position, Time now) { shift(position - demand(now).position); }

 private:
  void shift(double distance);
  void take_over_units();
  void place_home_switch();
  Profile::Range position_range() const;
  Load::Lead lead() const;
  double deceleration(Ramp ramp) const;
  double per_minute(double revolutions) const;
  Time passes_beside(double position, const Profile::Range& range, Time now) const;
  double negative_limit() const;  ///< places; infinite without a switch
  double positive_limit() const;
  void follow_profile(const Profile& profile, Time now);

  DriveObjects& objects_;
  AxisLayout layout_;
  UnitFactors factors_{};
  Units units_{};
  Profile profile_{};
  double target_ = 0;
  double zero_ = 0;  ///< position of machine coordinate 0
  double blocked_at_ = 0;
  bool blocked_ = false;
  Load load_;
  bool led_ = true;  ///< by the position profile; only a load can be without
  const Profile* torque_ = nullptr;
  Time profile_since_ = kNever;
  double most_before_ = 0;
  Time torque_end_ = 0;
};

}  // namespace cbcan::devices

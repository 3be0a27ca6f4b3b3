// SPDX-License-Identifier: MIT
#pragma once

/// One axis: motor, encoder and what it drives. It does what the profile demands, exactly, unless its motor
/// is blocked or has a load, see load.hpp. Positions here are increments from the zero of position (what
/// homing sets); the switches stand at places of the machine, which homing does not move.
///
/// An axis without power runs down with the quick stop deceleration (6085h), or with a load by friction.

#include <cstdint>

#include "devices/drive/axis_layout.hpp"
#include "devices/drive/load.hpp"
#include "devices/drive/objects.hpp"
#include "devices/drive/profile.hpp"
#include "devices/drive/units.hpp"

namespace cbcan::devices {

/// Which switches are active.
struct AxisSwitches {
  bool negative_limit = false;
  bool positive_limit = false;
  bool home = false;
};

/// The ramps that option codes 605Ah..605Eh choose.
enum class Ramp : std::uint8_t {
  kSlowDown,   ///< profile deceleration, 6084h
  kQuickStop,  ///< quick stop deceleration, 6085h
};

class Axis {
 public:
  Axis(DriveObjects& objects, const AxisLayout& layout)
      : objects_(objects), layout_(layout), load_(layout.load) {}

  /// Power-on: at rest, and position 0 is here.
  void reset(Time now);

  /// Takes over changed units and wraps the position into its range (607Bh, else INTEGER32).
  void refresh(Time now);

  // Motion. All of it begins now, from the motion that is.
  void move_to(double target, const Dynamics& dynamics, Time now);
  void run_at(double velocity, double acceleration, double deceleration, Time now);
  void line_to(double target, Time duration, Time now);
  void change_evenly_to(double velocity, Time duration, Time now);
  void stop(Ramp ramp, Time now);
  /// Says where it is to go, without going.
  void aim_at(double target) { target_ = target; }
  /// The demand becomes what the axis really does: before a profile is left for good.
  void give_up_demand(Time now);

  Motion demand(Time now) const { return led_ ? profile_.at(now) : load_.at(now); }
  Motion actual(Time now) const {
    if (blocked_) return {blocked_at_, 0};
    return load_.exists() ? load_.at(now) : profile_.at(now);
  }
  const Profile& profile() const { return profile_; }
  bool over(Time now) const { return now >= profile_.end(); }
  /// It does what the profile demands, and stays within its range: nothing else becomes of it on the way.
  bool just_moves() const;
  /// The profile is over and the axis stands.
  bool at_rest(Time now) const { return over(now) && profile_.final_velocity() == 0; }
  /// What move_to(), line_to() or aim_at() was told last.
  double target() const { return target_; }

  /// A blocked motor stays where it is, whatever is demanded. Freed, it starts again from there.
  void set_blocked(bool blocked, Time now);
  bool blocked() const { return blocked_; }
  double blocked_at() const { return blocked_at_; }

  // The load, if there is one.
  bool has_load() const { return load_.exists(); }
  /// Before anything that it follows changes.
  void carry(Time now) {
    if (load_.exists()) load_.follow(lead(), now);
  }
  /// Whether there is power, and the torque that is asked for in the place of a position: from now on.
  void drive(bool powered, const Profile* torque, Time now);
  /// In thousandths of the rated one.
  double load_torque() const { return load_.torque(); }
  /// A load takes all of most_torque().
  bool lacks_torque() const { return load_.is_limited(); }
  /// When it has moved further; kNever = it rests.
  Time next_load_step(Time now) const { return load_.next_change(now); }
  /// Either way: the motor's current makes its torque.
  double most_torque() const;

  // What the objects say, in increments.
  Dynamics profile_dynamics() const;
  double max_velocity() const;
  /// Within the software position limits (607Dh), which count where the lower is below the upper.
  double within_limits(double position) const;
  bool has_limits() const;
  double increments(double user) const { return units_.increments(user); }
  double user(double increments) const { return units_.user(increments); }
  double increments_per_second(double user) const { return units_.increments_per_second(user); }
  double user_velocity(double increments) const { return units_.user_velocity(increments); }

  // The machine.
  /// An axis that goes round (607Bh narrower than INTEGER32) has no ends.
  bool goes_round() const;
  AxisSwitches switches(Time now) const;
  /// After `now`.
  Time passes(double position, Time now) const;
  /// When a switch may change next.
  Time next_switch(Time now) const;
  const AxisLayout& layout() const { return layout_; }
  double to_machine(double position) const { return position - zero_; }
  double from_machine(double place) const { return place + zero_; }
  double index_pitch() const { return units_.increments_per_revolution(); }
  /// The place where it is now is `position` from here on.
  void set_position(double position, Time now) { shift(position - demand(now).position); }

 private:
  void shift(double distance);
  void take_over_units();
  Profile::Range position_range() const;
  Load::Lead lead() const;
  double negative_limit() const;  ///< places; infinite without a switch
  double positive_limit() const;
  void follow_profile(const Profile& profile, Time now);

  DriveObjects& objects_;
  AxisLayout layout_;
  UnitFactors factors_{};
  Units units_{};
  Profile profile_{};
  double target_ = 0;
  double zero_ = 0;  ///< position of the machine's place 0
  double blocked_at_ = 0;
  bool blocked_ = false;
  Load load_;
  bool led_ = true;  ///< by the profile: always, without a load
  const Profile* torque_ = nullptr;
  Time profile_since_ = kNever;
  double most_before_ = 0;
  Time torque_end_ = 0;
};

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#pragma once

/// The modes of operation of a drive (6060h).

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "cbcan/time.hpp"
#include "devices/drive/axis.hpp"
#include "devices/drive/power_stage.hpp"

namespace cbcan::devices {

/// Input of a mode in addition to its objects.
struct ModeInput {
  std::uint16_t controlword = 0;
  bool negative_limit = false;  ///< the limit switch stops the axis
  bool positive_limit = false;

  bool has(std::uint16_t bit) const { return (controlword & bit) != 0; }
  /// A limit switch blocks this direction (only its sign counts).
  bool barred(double direction) const {
    return (direction > 0 && positive_limit) || (direction < 0 && negative_limit);
  }
};

/// Base of the modes of operation (6060h). A mode moves the axis from enter() on, while operation is enabled
/// and the mode is selected; after that, the power stage or the next mode does.
class Mode {
 public:
  Mode(DriveObjects& objects, Axis& axis) : objects_(objects), axis_(axis) {}
  virtual ~Mode() = default;

  /// Operation has been enabled in this mode, or the mode has been selected. The axis may be moving.
  virtual void enter(const ModeInput& input, Time now) = 0;
  /// Does all that is due by `now`.
  virtual void run(const ModeInput& /*input*/, Time /*now*/) {}
  /// Set-points come with SYNCs: they may be missed.
  virtual bool follows_sync() const { return false; }
  virtual void on_sync(const ModeInput& /*input*/, Time /*now*/) {}
  /// The motor is no longer blocked: continue to the target from the current position.
  virtual void resume(Time /*now*/) {}

  /// Statusword bits 10..13 of this mode, except for a following error.
  virtual std::uint16_t status(Time now) const = 0;
  /// When run() or status() will have a new result, apart from changes of the axis's profile; kNever = never.
  /// Times up to `now` are ignored.
  virtual Time deadline(Time /*now*/) const { return kNever; }
  /// Demand, in thousandths of the rated torque.
  virtual double torque(Time /*now*/) const { return 0; }
  /// The torque of torque modes, as the velocity of this profile; else null.
  virtual const Profile* torque_profile() const { return nullptr; }

 protected:
  /// The ramp of the halt option code (605Dh).
  Ramp halt_ramp() const { return objects_.halt_option.get() == 1 ? Ramp::kSlowDown : Ramp::kQuickStop; }

  DriveObjects& objects_;
  Axis& axis_;
  bool limited_ = false;  ///< the demand is less than the set-point
};

/// Modes in which the axis runs at a velocity, with ramps that take effect when they change. At a software
/// position limit the axis stops until a velocity in the other direction is set.
class VelocityMode : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& /*input*/, Time /*now*/) override { plan_.reset(); }
  void resume(Time /*now*/) override { plan_.reset(); }

 protected:
  /// Everything that the profile depends on.
  struct Plan {
    Dynamics dynamics;  ///< with a velocity of 0
    double velocity = 0;
    double limit = 0;
    std::optional<Ramp> stop;  ///< by command
    bool barred = false;
    bool operator==(const Plan&) const = default;
  };

  /// Moves to `wanted`, in increments/s, at most the greatest velocity.
  void run_at(double wanted, const Dynamics& dynamics, std::optional<Ramp> stop, const ModeInput& input,
              Time now);
  /// Statusword bit 11.
  std::uint16_t limit_bit(Time now) const;

  std::optional<Plan> plan_;  ///< set by run_at()
};

/// Profile velocity (6060h = 3): 60FFh with the ramps 6083h and 6084h.
class ProfileVelocity final : public VelocityMode {
 public:
  using VelocityMode::VelocityMode;

  void run(const ModeInput& input, Time now) override;
  std::uint16_t status(Time now) const override;
  Time deadline(Time now) const override;

 private:
  bool steady(Time now, std::uint16_t for_milliseconds) const;
};

/// Runs the axis at `velocity`, up to the software position limit if there is one. False = it is already at
/// the limit or beyond.
bool run_within_limits(Axis& axis, double velocity, const Dynamics& dynamics, Time now);

/// Velocity mode of frequency inverters (6060h = 2, "vl"): 6042h, scaled by 604Bh, with an amount between
/// those of 6046h, and the ramps 6048h and 6049h. Velocities are 1/min of the motor, scaled by 604Ch.
///
/// Controlword bits 4, 5, 6: the motor follows the ramp, the ramp moves, the ramp goes to 6042h. Without bit
/// 4 the motor stops with 604Ah; without bit 5 it keeps its velocity; without bit 6 the ramp goes to 0. Many
/// inverters ignore these bits: until one of them has been 1, all are taken as 1. Halt (605Dh) and quick stop
/// use 6049h and 604Ah. The mode has no statusword bits except bit 11.
class Velocity final : public VelocityMode {
 public:
  using VelocityMode::VelocityMode;

  /// Power-on.
  void reset() { has_ramp_bits_ = false; }
  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  std::uint16_t status(Time now) const override { return limit_bit(now); }

  /// Updates 6043h and 6044h.
  void show(double demand, double actual);

 private:
  double within_amounts(double velocity) const;
  double factor() const { return objects_.vl_set_point_factor.value(); }

  bool has_ramp_bits_ = false;    ///< one of them has been 1
  std::optional<double> locked_;  ///< while bit 5 is 0, increments/s
};

/// Profile position mode (6060h = 1): set-points with the handshake of controlword bit 4 and statusword
/// bit 12.
///
/// The rising edge of bit 4 takes 607Ah, 6081h, 6083h and 6084h. With bit 5 set, the new set-point replaces
/// all others immediately. Otherwise it waits until the present one is reached; at most one waits. With bit 9
/// set, the axis passes the present set-point at profile velocity instead of stopping there, if the next one
/// is far enough beyond it to stop in time. Bit 12 is 1 until bit 4 is 0 and another set-point can be taken.
/// Relative set-points (bit 6) count from the previous set-point.
///
/// 60F2h: relative set-points count from the demand (bits 0, 1 = 1) or from the actual position (2). A rotary
/// axis turns as the numbers say (bits 6, 7 = 0), in negative (1) or positive direction (2), or the shortest
/// way (3).
class ProfilePosition final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  void resume(Time now) override;
  std::uint16_t status(Time now) const override;
  Time deadline(Time now) const override;

 private:
  struct SetPoint {
    double target;  ///< increments
    bool relative;
    Dynamics dynamics;
  };

  void take(const ModeInput& input, Time now);
  void begin(const SetPoint& set_point, Time now);
  double target_of(const SetPoint& set_point, double base) const;
  double base(Time now) const;
  double way_round(double target, double from) const;
  void pass_through(Time now);
  void hold_or_go(const ModeInput& input, Time now);
  bool reached(Time now) const;
  Time reached_at() const;

  std::optional<SetPoint> next_;
  Dynamics dynamics_{};
  Time pass_at_ = kNever;  ///< when the set-point is passed
  double direction_ = 0;   ///< of the set-point at its start; only its sign counts; 0 = reached
  bool has_target_ = false;
  bool go_ = false;  ///< a new set-point has no profile yet
  bool held_ = false;
  bool halted_ = false;
  bool bit_before_ = false;
  bool acknowledged_ = false;
};

inline constexpr std::int8_t kNoHoming = 0;

bool is_homing_method(std::int8_t method);

/// Part of a search: run in a direction (+1, -1) until a place has been passed.
struct HomingLeg {
  double direction;
  double until;  ///< machine coordinate, increments
};

struct HomingWay {
  std::vector<HomingLeg> legs{};  ///< at the speed for switches
  double home = 0;                ///< approached after the legs, at the speed for zero
  bool blind = false;             ///< the legs end at a limit switch without finding home
  bool hard = false;              ///< the last leg ends at a hard stop, without a ramp
};

/// The path from `place`, in machine coordinates; `pitch` is the distance between index pulses. The method
/// must be supported.
HomingWay homing_way(std::int8_t method, double place, const AxisLayout& layout, double pitch);

/// Homing mode (6060h = 6). The rising edge of controlword bit 4 starts the method of 6098h with the speeds
/// 6099h and the acceleration 609Ah. Clearing bit 4 ends it. Halt interrupts it; after halt, the search
/// starts again from the current position. The axis stops at its home; the zero of position is 607Ch beyond
/// it, so 6064h reads -607Ch. Method 0 is attained immediately and changes nothing.
///
/// Statusword bits 13, 12, 10: 0 0 0 in progress; 0 0 1 not started or interrupted; 0 1 1 attained; 1 0 0
/// error, still moving; 1 0 1 error. Errors are an unsupported method, and a limit switch that the method
/// does not use.
///
/// Methods are paths along an axis whose switches are known: 1..14 find an index
/// pulse after a switch, 17..30 the switch itself, 33 and 34 the next index pulse, 35 and 37 use the current
/// position, 0 is no homing. Hard stops, beyond the limit switches: -3 the positive one, -4 and 36 the
/// negative one, -1 and -2 the next index pulse from them; vendors differ in the signs, these are maxon's.
/// 15, 16, 31, 32 and the rest are reserved or not supported.
class Homing final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  void resume(Time now) override;
  std::uint16_t status(Time now) const override;
  Time deadline(Time /*now*/) const override { return leg_ends_; }

 private:
  enum class Phase : std::uint8_t { kIdle, kHalted, kSearching, kToHome, kAttained, kFailed };

  void start(Time now);
  void next_leg(Time now);
  void end(Phase phase, Ramp ramp, Time now);
  bool in_progress() const { return phase_ == Phase::kSearching || phase_ == Phase::kToHome; }

  HomingWay way_{};
  std::size_t leg_ = 0;
  Time leg_ends_ = kNever;
  double direction_ = 0;  ///< of the leg; only its sign counts
  Phase phase_ = Phase::kIdle;
  bool bit_before_ = false;
};

/// 60C2h in microseconds, at most an hour.
Time interpolation_period(const DriveObjects& objects);

/// Statusword bits of a cyclic mode.
constexpr std::uint16_t cyclic_status(bool limited) {
  return limited ? statusword::kFollowsCommand | statusword::kInternalLimit : statusword::kFollowsCommand;
}

/// Cyclic synchronous position and velocity (6060h = 8, 9), and interpolated position (7): the controller
/// generates the profile. The set-point that is present at a SYNC is reached linearly within one
/// interpolation period (60C2h). The last set-point holds: the position stays, the velocity continues.
/// Without SYNC nothing moves. The same set-point at a further SYNC within that period does not start it
/// again.
///
/// 60B0h and 60B1h are added. Positions are limited to 607Dh and steps to the velocity of 607Fh and 6080h;
/// statusword bit 11 is then set. A limit switch stops cyclic velocity immediately, cyclic position at the
/// next SYNC. With 607Dh in force, cyclic velocity decelerates at 6084h.
///
/// Straight lines of one period each.
class LineMode : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;

 protected:
  /// Moves to a position in user units. `also_at_rest`: a line without length takes its period too.
  void draw_line(double user, const ModeInput& input, Time now, bool also_at_rest);

  Time line_ends_ = 0;
};

class CyclicPosition final : public LineMode {
 public:
  using LineMode::LineMode;

  bool follows_sync() const override { return true; }
  void on_sync(const ModeInput& input, Time now) override;
  std::uint16_t status(Time /*now*/) const override { return cyclic_status(limited_); }
};

/// 60C1h:1 as the set-point, while controlword bit 4 is 1; statusword bit 12 shows that. With a buffer
/// (60C4h:2 more than 1) each point that is written waits there, and one is taken each period, without SYNC.
/// The same value as before is another point only if it is written by SDO. A point without room is lost.
class InterpolatedPosition final : public LineMode {
 public:
  using LineMode::LineMode;

  /// 60C1h:1 has been written by SDO, possibly with the same value.
  void point_written() { is_written_ = true; }
  void clear_buffer() { points_.clear(); }

  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  bool follows_sync() const override { return active_ && !has_buffer(); }
  void on_sync(const ModeInput& input, Time now) override;
  std::uint16_t status(Time now) const override;
  Time deadline(Time /*now*/) const override { return has_buffer() ? line_ends_ : kNever; }

 private:
  bool has_buffer() const { return objects_.interpolation_buffer.get() > 1; }
  void take_point();

  std::deque<std::int32_t> points_;  ///< user units
  std::int32_t last_point_ = 0;
  bool is_written_ = false;
  bool active_ = false;
};

class CyclicVelocity final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  bool follows_sync() const override { return true; }
  void on_sync(const ModeInput& input, Time now) override;
  std::uint16_t status(Time /*now*/) const override { return cyclic_status(limited_); }

 private:
  double velocity_ = 0;  ///< the last set-point, increments/s
  Time change_ends_ = 0;
};

/// Profile torque and cyclic synchronous torque (6060h = 4, 10). Torque moves an axis only if it has a load.
/// Torques are thousandths of the rated torque, at most 6072h in either direction; current (6078h, 6073h) is
/// proportional to torque.
class TorqueMode : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  Time deadline(Time now) const override { return torque_.next_change(now); }
  double torque(Time now) const override { return torque_.at(now).velocity; }
  const Profile* torque_profile() const override { return &torque_; }

 protected:
  /// Clamped to the limits; sets limited_.
  double limited(double torque);
  Motion present(Time now) const { return {0, torque(now)}; }

  Profile torque_;  ///< its velocity is the torque
  double target_ = 0;
};

/// 6071h with the slope 6087h, thousandths per second; halt ramps to 0.
class ProfileTorque final : public TorqueMode {
 public:
  using TorqueMode::TorqueMode;

  void run(const ModeInput& input, Time now) override;
  std::uint16_t status(Time now) const override;

 private:
  double slope_ = 0;
};

/// 6071h + 60B2h at each SYNC, reached one interpolation period (60C2h) later.
class CyclicTorque final : public TorqueMode {
 public:
  using TorqueMode::TorqueMode;

  bool follows_sync() const override { return true; }
  void on_sync(const ModeInput& input, Time now) override;
  std::uint16_t status(Time /*now*/) const override { return cyclic_status(limited_); }
};

}  // namespace cbcan::devices

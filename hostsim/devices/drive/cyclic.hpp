// SPDX-License-Identifier: MIT
#pragma once

/// Cyclic synchronous position and velocity (6060h = 8, 9), and interpolated position (7): the controller
/// generates the profile. The set-point that is present at a SYNC is reached linearly within one
/// interpolation period (60C2h). The last set-point holds: the position stays, the velocity continues.
/// Without SYNC nothing moves. The same set-point at a further SYNC within that period does not start it
/// again.
///
/// 60B0h and 60B1h are added. Positions are limited to 607Dh and steps to the velocity of 607Fh and 6080h;
/// statusword bit 11 is then set. A limit switch stops cyclic velocity immediately, cyclic position at the
/// next SYNC. With 607Dh in force, cyclic velocity decelerates at 6084h.

#include <cstdint>
#include <deque>

#include "devices/drive/mode.hpp"

namespace cbcan::devices {

/// 60C2h in microseconds, at most an hour.
Time interpolation_period(const DriveObjects& objects);

/// Statusword bits of a cyclic mode.
constexpr std::uint16_t cyclic_status(bool limited) {
  return limited ? statusword::kFollowsCommand | statusword::kInternalLimit : statusword::kFollowsCommand;
}

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

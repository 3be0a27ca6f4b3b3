// SPDX-License-Identifier: MIT
#pragma once

/// Cyclic synchronous position and velocity (6060h = 8, 9): the controller generates the profile. The
/// set-point that is present at a SYNC is reached linearly within one interpolation period (60C2h). The last
/// set-point holds: the position stays, the velocity continues. Without SYNC nothing moves. The same set-point
/// at a further SYNC within that period does not start it again.
///
/// 60B0h and 60B1h are added. Positions are limited to 607Dh and steps to the velocity of 607Fh and 6080h;
/// statusword bit 11 is then set. A limit switch stops cyclic velocity immediately, cyclic position at the
/// next SYNC. With 607Dh in force, cyclic velocity decelerates at 6084h.

#include "devices/drive/mode.hpp"

namespace cbcan::devices {

/// 60C2h in microseconds, at most an hour.
Time interpolation_period(const DriveObjects& objects);

/// Statusword bits of a cyclic mode.
constexpr std::uint16_t cyclic_status(bool limited) {
  return limited ? statusword::kFollowsCommand | statusword::kInternalLimit : statusword::kFollowsCommand;
}

class CyclicPosition final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  void on_sync(const ModeInput& input, Time now) override;
  std::uint16_t status(Time /*now*/) const override { return cyclic_status(limited_); }

 private:
  Time line_ends_ = 0;
};

class CyclicVelocity final : public Mode {
 public:
  using Mode::Mode;

  void enter(const ModeInput& input, Time now) override;
  void run(const ModeInput& input, Time now) override;
  void on_sync(const ModeInput& input, Time now) override;
  std::uint16_t status(Time /*now*/) const override { return cyclic_status(limited_); }

 private:
  double velocity_ = 0;  ///< the last set-point, increments/s
  Time change_ends_ = 0;
};

}  // namespace cbcan::devices

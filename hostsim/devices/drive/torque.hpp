// SPDX-License-Identifier: MIT
#pragma once

/// Profile torque and cyclic synchronous torque (6060h = 4, 10). Torque moves an axis only if it has a load.
/// Torques are thousandths of the rated torque, at most 6072h in either direction; current (6078h, 6073h) is
/// proportional to torque.

#include "devices/drive/cyclic.hpp"

namespace cbcan::devices {

/// Common part of both.
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

/// 6071h + 60B2h at each SYNC, reached one interpolation period (60C2h) later; see cyclic.hpp.
class CyclicTorque final : public TorqueMode {
 public:
  using TorqueMode::TorqueMode;

  bool follows_sync() const override { return true; }
  void on_sync(const ModeInput& input, Time now) override;
  std::uint16_t status(Time /*now*/) const override { return cyclic_status(limited_); }
};

}  // namespace cbcan::devices

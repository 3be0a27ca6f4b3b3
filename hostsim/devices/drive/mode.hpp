// SPDX-License-Identifier: MIT
#pragma once

/// Base of the modes of operation (6060h). A mode moves the axis from enter() on, while operation is enabled
/// and the mode is selected; after that, the power stage or the next mode does.

#include <cstdint>

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

}  // namespace cbcan::devices

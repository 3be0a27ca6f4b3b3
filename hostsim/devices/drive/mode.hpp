// SPDX-License-Identifier: MIT
#pragma once

/// What the modes of operation (6060h) have in common. A mode moves the axis from enter() on, as long as
/// operation is enabled and the mode stays; what comes after that is the power stage's, or the next mode's.

#include <cstdint>

#include "cbcan/time.hpp"
#include "devices/drive/axis.hpp"
#include "devices/drive/power_state_machine.hpp"

namespace cbcan::devices {

/// What a mode has to respect, besides its objects.
struct ModeInput {
  std::uint16_t controlword = 0;
  bool negative_limit = false;  ///< limit switches that stop the axis now
  bool positive_limit = false;

  bool has(std::uint16_t bit) const { return (controlword & bit) != 0; }
  /// A limit switch lies in this direction (its sign).
  bool barred(double direction) const {
    return (direction > 0 && positive_limit) || (direction < 0 && negative_limit);
  }
};

class Mode {
 public:
  Mode(DriveObjects& objects, Axis& axis) : objects_(objects), axis_(axis) {}
  virtual ~Mode() = default;

  /// Operation has been enabled in this mode, or the mode has been chosen. The axis may be moving.
  virtual void enter(const ModeInput& input, Time now) = 0;
  /// Acts on what is to be done by `now`.
  virtual void run(const ModeInput& input, Time now) = 0;
  virtual void on_sync(const ModeInput& /*input*/, Time /*now*/) {}
  /// The motor has been freed: from here to where it was to go.
  virtual void resume(const ModeInput& /*input*/, Time /*now*/) {}

  /// Statusword bits 10..13 of this mode, but for a following error.
  virtual std::uint16_t status(Time now) const = 0;
  /// When run() or status() has something new, besides the changes of the axis's profile; kNever = never.
  /// What is not after `now` does not count.
  virtual Time deadline(Time /*now*/) const { return kNever; }
  /// Demand, in thousandths of the rated torque.
  virtual double torque(Time /*now*/) const { return 0; }
  /// Of a mode that gives the motor a torque, not a position: the velocity of this is the torque.
  virtual const Profile* torque_profile() const { return nullptr; }

 protected:
  /// The ramp that the halt option code (605Dh) names.
  Ramp halt_ramp() const { return objects_.halt_option.get() == 1 ? Ramp::kSlowDown : Ramp::kQuickStop; }

  DriveObjects& objects_;
  Axis& axis_;
};

}  // namespace cbcan::devices

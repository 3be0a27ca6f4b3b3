// SPDX-License-Identifier: MIT
#include "devices/drive/torque.hpp"

#include <algorithm>
#include <utility>

namespace cbcan::devices {

void TorqueMode::enter(const ModeInput& /*input*/, Time now) {
  torque_ = Profile(0);
  target_ = 0;
  limited_ = false;
  axis_.stop(Ramp::kSlowDown, now);
}

double TorqueMode::limited(double torque) {
  const double most = axis_.most_torque();
  const double target = std::clamp(torque, -most, most);
  limited_ = target != torque;
  return target;
}

void ProfileTorque::run(const ModeInput& input, Time now) {
  const double target = limited(input.has(controlword::kHalt) ? 0 : objects_.target_torque.get());
  const double slope = objects_.torque_slope.get();
  if (target == target_ && slope == slope_) return;
  target_ = target;
  slope_ = slope;
  torque_ = Profile::to_velocity(present(now), target, slope, slope, now);
}

std::uint16_t ProfileTorque::status(Time now) const {
  std::uint16_t bits = 0;
  if (now >= torque_.end()) bits |= statusword::kTargetReached;
  if (limited_) bits |= statusword::kInternalLimit;
  return bits;
}

void CyclicTorque::on_sync(const ModeInput& /*input*/, Time now) {
  const double target = limited(objects_.target_torque.get() + objects_.torque_offset.get());
  if (std::exchange(target_, target) == target && now < torque_.end()) return;
  torque_ = Profile::even_change(present(now), target, interpolation_period(objects_), now);
}

}  // namespace cbcan::devices

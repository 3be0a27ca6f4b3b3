// SPDX-License-Identifier: MIT
#include "devices/drive/torque.hpp"

#include <algorithm>
#include <utility>

#include "devices/drive/cyclic.hpp"

namespace cbcan::devices {

void ProfileTorque::enter(const ModeInput& /*input*/, Time now) {
  torque_ = Profile(0);
  target_ = 0;
  axis_.stop(Ramp::kSlowDown, now);
}

void ProfileTorque::run(const ModeInput& input, Time now) {
  const double most = axis_.most_torque();
  const double wanted = input.has(controlword::kHalt) ? 0 : objects_.target_torque.get();
  const double target = std::clamp(wanted, -most, most);
  limited_ = target != wanted;
  const double slope = objects_.torque_slope.get();
  if (target == target_ && slope == slope_) return;
  target_ = target;
  slope_ = slope;
  torque_ = Profile::to_velocity({0, torque_.at(now).velocity}, target, slope, slope, now);
}

std::uint16_t ProfileTorque::status(Time now) const {
  std::uint16_t bits = 0;
  if (now >= torque_.end()) bits |= statusword::kTargetReached;
  if (limited_) bits |= statusword::kInternalLimit;
  return bits;
}

void CyclicTorque::enter(const ModeInput& /*input*/, Time now) {
  torque_ = Profile(0);
  target_ = 0;
  limited_ = false;
  axis_.stop(Ramp::kSlowDown, now);
}

void CyclicTorque::on_sync(const ModeInput& /*input*/, Time now) {
  const double most = axis_.most_torque();
  const double wanted = objects_.target_torque.get() + objects_.torque_offset.get();
  const double target = std::clamp(wanted, -most, most);
  limited_ = target != wanted;
  if (std::exchange(target_, target) == target && now < torque_.end()) return;
  torque_ = Profile::even_change({0, torque_.at(now).velocity}, target, interpolation_period(objects_), now);
}

std::uint16_t CyclicTorque::status(Time /*now*/) const {
  return static_cast<std::uint16_t>(statusword::kFollowsCommand |
                                    (limited_ ? statusword::kInternalLimit : 0));
}

}  // namespace cbcan::devices

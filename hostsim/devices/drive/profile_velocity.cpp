// SPDX-License-Identifier: MIT
#include "devices/drive/profile_velocity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cbcan::devices {

namespace {

/// The software limit in this direction.
double limit_ahead(const Axis& axis, double direction) {
  constexpr double kFar = std::numeric_limits<double>::max();
  return axis.has_limits() ? axis.within_limits(direction < 0 ? -kFar : kFar) : 0;
}

}  // namespace

bool run_within_limits(Axis& axis, double velocity, const Dynamics& dynamics, Time now) {
  if (!axis.has_limits() || velocity == 0) {
    axis.run_at(velocity, dynamics.acceleration, dynamics.deceleration, now);
    return true;
  }
  const double limit = limit_ahead(axis, velocity);
  if ((limit - axis.demand(now).position) * velocity <= 0) {
    axis.run_at(0, dynamics.acceleration, dynamics.deceleration, now);
    return false;
  }
  axis.move_to(limit, {std::abs(velocity), dynamics.acceleration, dynamics.deceleration}, now);
  return true;
}

void ProfileVelocity::run(const ModeInput& input, Time now) {
  const double wanted = axis_.increments_per_second(objects_.target_velocity.get());
  const double most = axis_.max_velocity();
  Plan plan;
  plan.velocity = std::clamp(wanted, -most, most);
  plan.dynamics = axis_.profile_dynamics();
  plan.dynamics.velocity = 0;  // 6081h means nothing here
  plan.limit = limit_ahead(axis_, wanted);
  plan.halted = input.has(controlword::kHalt);
  plan.barred = input.barred(wanted);
  limited_ = plan.velocity != wanted;
  if (plan_ == plan) return;
  plan_ = plan;
  if (plan.halted) return axis_.stop(halt_ramp(), now);
  if (plan.barred) return axis_.stop(Ramp::kQuickStop, now);
  run_within_limits(axis_, plan.velocity, plan.dynamics, now);
}

bool ProfileVelocity::steady(Time now, std::uint16_t for_milliseconds) const {
  const Time since = axis_.profile().steady_since(now);
  return since != kNever && now >= since + milliseconds(for_milliseconds);
}

std::uint16_t ProfileVelocity::status(Time now) const {
  const double velocity = axis_.actual(now).velocity;
  const double off = std::abs(velocity - plan_->velocity);
  const bool in_window = off <= axis_.increments_per_second(objects_.velocity_window.get()) &&
                         steady(now, objects_.velocity_window_time.get());
  const bool slow = std::abs(velocity) <= axis_.increments_per_second(objects_.velocity_threshold.get()) &&
                    steady(now, objects_.velocity_threshold_time.get());
  const bool at_limit = axis_.has_limits() && plan_->velocity != 0 && !plan_->halted && axis_.at_rest(now);
  std::uint16_t bits = 0;
  if (plan_->halted ? axis_.at_rest(now) : in_window) bits |= statusword::kTargetReached;
  if (slow) bits |= statusword::kSpeedZero;
  if (limited_ || plan_->barred || at_limit) bits |= statusword::kInternalLimit;
  return bits;
}

Time ProfileVelocity::deadline(Time now) const {
  const Time since = axis_.profile().steady_since(now);
  if (since == kNever) return kNever;
  Time first = kNever;
  for (const std::uint16_t time :
       {objects_.velocity_window_time.get(), objects_.velocity_threshold_time.get()})
    if (since + milliseconds(time) > now) first = earlier(first, since + milliseconds(time));
  return first;
}

}  // namespace cbcan::devices

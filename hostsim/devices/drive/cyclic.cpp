// SPDX-License-Identifier: MIT
#include "devices/drive/cyclic.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/drive/profile_velocity.hpp"

namespace cbcan::devices {

namespace {
constexpr double kTicksPerSecond = 1e6;
constexpr Time kLongestPeriod = 3600 * kSecond;
constexpr int kMicro = -6;
}  // namespace

Time interpolation_period(const DriveObjects& objects) {
  Time period = objects.interpolation_time.get();
  int exponent = objects.interpolation_exponent.get();
  for (; exponent > kMicro && period < kLongestPeriod && period != 0; --exponent)
    period *= 10;
  for (; exponent < kMicro && period != 0; ++exponent)
    period /= 10;
  return std::min(period, kLongestPeriod);
}

void CyclicPosition::enter(const ModeInput& /*input*/, Time now) {
  limited_ = false;
  line_ends_ = 0;
  axis_.stop(Ramp::kSlowDown, now);
}

void CyclicPosition::on_sync(const ModeInput& input, Time now) {
  const Time period = interpolation_period(objects_);
  const double here = axis_.demand(now).position;
  const double user = double{1} * objects_.target_position.get() + objects_.position_offset.get();
  const double wanted = std::round(axis_.increments(user));
  const double step = axis_.max_velocity() * static_cast<double>(period) / kTicksPerSecond;
  double target = axis_.within_limits(wanted);
  if (period != 0) target = std::clamp(target, here - step, here + step);
  if (input.barred(target - here)) target = here;
  limited_ = target != wanted;
  if (target == axis_.target() && now < line_ends_ && !axis_.over(now)) return;
  line_ends_ = now + period;
  axis_.line_to(target, period, now);
}

void CyclicVelocity::enter(const ModeInput& /*input*/, Time now) {
  limited_ = false;
  velocity_ = 0;
  change_ends_ = 0;
  axis_.stop(Ramp::kSlowDown, now);
}

void CyclicVelocity::run(const ModeInput& input, Time now) {
  if (!input.barred(velocity_)) return;
  limited_ = true;
  velocity_ = 0;
  change_ends_ = 0;
  axis_.stop(Ramp::kQuickStop, now);
}

void CyclicVelocity::on_sync(const ModeInput& input, Time now) {
  const Time period = interpolation_period(objects_);
  const double most = axis_.max_velocity();
  const double user = double{1} * objects_.target_velocity.get() + objects_.velocity_offset.get();
  const double wanted = axis_.increments_per_second(user);
  const double before = std::exchange(velocity_, input.barred(wanted) ? 0 : std::clamp(wanted, -most, most));
  limited_ = velocity_ != wanted;
  if (velocity_ == before && now < change_ends_ && !axis_.over(now)) return;
  change_ends_ = now + period;
  if (!axis_.has_limits()) return axis_.change_evenly_to(velocity_, period, now);
  const double change = std::abs(velocity_ - axis_.demand(now).velocity);
  Dynamics dynamics = axis_.profile_dynamics();
  dynamics.acceleration = period == 0 ? 0 : change * kTicksPerSecond / static_cast<double>(period);
  if (!run_within_limits(axis_, velocity_, dynamics, now)) limited_ = true;
}

}  // namespace cbcan::devices

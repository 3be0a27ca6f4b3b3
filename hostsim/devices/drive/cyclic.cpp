// SPDX-License-Identifier: MIT
#include "devices/drive/modes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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

void LineMode::enter(const ModeInput& /*input*/, Time now) {
  limited_ = false;
  line_ends_ = 0;
  axis_.stop(Ramp::kSlowDown, now);
}

void LineMode::draw_line(double user, const ModeInput& input, Time now, bool also_at_rest) {
  const Time period = interpolation_period(objects_);
  const double here = axis_.demand(now).position;
  const double wanted = std::round(axis_.increments(user));
  const double step = axis_.max_velocity() * static_cast<double>(period) / kTicksPerSecond;
  double target = axis_.within_limits(wanted);
  if (period != 0) target = std::clamp(target, here - step, here + step);
  if (input.barred(target - here)) target = here;
  limited_ = target != wanted;
  if (!also_at_rest && target == here && axis_.at_rest(now)) return;
  if (target == axis_.target() && now < line_ends_ && !axis_.over(now)) return;
  line_ends_ = now + period;
  axis_.line_to(target, period, now);
}

void CyclicPosition::on_sync(const ModeInput& input, Time now) {
  draw_line(double{1} * objects_.target_position.get() + objects_.position_offset.get(), input, now, false);
}

void InterpolatedPosition::enter(const ModeInput& input, Time now) {
  LineMode::enter(input, now);
  points_.clear();
  last_point_ = objects_.interpolation_data.get();
  active_ = is_written_ = false;
}

void InterpolatedPosition::run(const ModeInput& input, Time now) {
  take_point();
  const bool halt = input.has(controlword::kHalt);
  const bool active = input.has(controlword::kInterpolate) && !halt;
  if (std::exchange(active_, active) && !active) {
    axis_.stop(halt ? halt_ramp() : Ramp::kSlowDown, now);
    line_ends_ = 0;
  }
  for (; active_ && !points_.empty() && now >= line_ends_; points_.pop_front())
    draw_line(points_.front(), input, now, true);
  objects_.interpolation_points.set(static_cast<std::uint16_t>(points_.size()));
}

void InterpolatedPosition::take_point() {
  const std::int32_t point = objects_.interpolation_data.get();
  const bool is_new = std::exchange(is_written_, false) || point != last_point_;
  last_point_ = point;
  if (is_new && has_buffer() && points_.size() < objects_.interpolation_buffer.get())
    points_.push_back(point);
}

void InterpolatedPosition::on_sync(const ModeInput& input, Time now) {
  if (follows_sync()) draw_line(objects_.interpolation_data.get(), input, now, false);
}

std::uint16_t InterpolatedPosition::status(Time now) const {
  std::uint16_t bits = 0;
  if (active_) bits |= statusword::kInterpolates;
  if (points_.empty() && axis_.at_rest(now)) bits |= statusword::kTargetReached;
  if (limited_) bits |= statusword::kInternalLimit;
  return bits;
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

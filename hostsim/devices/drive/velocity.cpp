// SPDX-License-Identifier: MIT
#include "devices/drive/modes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/number.hpp"

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

void VelocityMode::run_at(double wanted, const Dynamics& dynamics, std::optional<Ramp> stop,
                          const ModeInput& input, Time now) {
  const double most = axis_.max_velocity();
  const Plan plan{dynamics, std::clamp(wanted, -most, most), limit_ahead(axis_, wanted), stop,
                  input.barred(wanted)};
  limited_ = plan.velocity != wanted;
  if (plan_ == plan) return;
  plan_ = plan;
  if (stop) return axis_.stop(*stop, now);
  if (plan.barred) return axis_.stop(Ramp::kQuickStop, now);
  run_within_limits(axis_, plan.velocity, dynamics, now);
}

std::uint16_t VelocityMode::limit_bit(Time now) const {
  const bool at_limit = axis_.has_limits() && plan_->velocity != 0 && !plan_->stop && axis_.at_rest(now);
  return limited_ || plan_->barred || at_limit ? statusword::kInternalLimit : 0;
}

void ProfileVelocity::run(const ModeInput& input, Time now) {
  Dynamics dynamics = axis_.profile_dynamics();
  dynamics.velocity = 0;  // 6081h means nothing here
  const auto stop = input.has(controlword::kHalt) ? std::optional(halt_ramp()) : std::nullopt;
  run_at(axis_.increments_per_second(objects_.target_velocity.get()), dynamics, stop, input, now);
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
  std::uint16_t bits = limit_bit(now);
  if (plan_->stop ? axis_.at_rest(now) : in_window) bits |= statusword::kTargetReached;
  if (slow) bits |= statusword::kSpeedZero;
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

void Velocity::enter(const ModeInput& input, Time now) {
  VelocityMode::enter(input, now);
  locked_.reset();
}

/// Clamped to the amounts of 6046h; 0 stays 0.
double Velocity::within_amounts(double velocity) const {
  const double most = objects_.vl_max.get();
  double amount = std::max(std::abs(velocity), double{1} * objects_.vl_min.get());
  if (most != 0) amount = std::min(amount, most);
  return velocity == 0 ? 0 : std::copysign(amount, velocity);
}

void Velocity::run(const ModeInput& input, Time now) {
  has_ramp_bits_ |= input.has(controlword::kRampBits);
  const auto has = [&](std::uint16_t bit) { return !has_ramp_bits_ || input.has(bit); };
  std::optional<Ramp> stop;
  if (!has(controlword::kEnableRamp)) stop = Ramp::kQuickStop;
  if (input.has(controlword::kHalt)) stop = halt_ramp();
  if (has(controlword::kUnlockRamp))
    locked_.reset();
  else if (!locked_)
    locked_ = axis_.demand(now).velocity;
  const double wanted = has(controlword::kReferenceRamp) ? objects_.vl_target.get() * factor() : 0;
  const double velocity = within_amounts(wanted);
  const Dynamics dynamics{0, axis_.slope(objects_.vl_acceleration), axis_.slope(objects_.vl_deceleration)};
  run_at(locked_ ? *locked_ : axis_.from_vl(velocity), dynamics, stop, input, now);
  limited_ |= velocity != wanted;
}

void Velocity::show(double demand, double actual) {
  objects_.vl_demand.set(sim::rounded<std::int16_t>(axis_.to_vl(demand) / factor()));
  objects_.vl_actual.set(sim::rounded<std::int16_t>(axis_.to_vl(actual) / factor()));
}

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#include "devices/drive/velocity.hpp"

#include <algorithm>
#include <cmath>

#include "sim/number.hpp"

namespace cbcan::devices {

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

double Velocity::factor() const {
  return ratio(objects_.vl_set_point_factor, objects_.vl_set_point_divisor);
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

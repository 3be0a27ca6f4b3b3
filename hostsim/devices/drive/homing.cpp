// SPDX-License-Identifier: MIT
#include "devices/drive/homing.hpp"

#include <algorithm>
#include <cmath>

namespace cbcan::devices {

void Homing::enter(const ModeInput& input, Time now) {
  bit_before_ = input.has(controlword::kStartHoming);
  end(Phase::kIdle, Ramp::kSlowDown, now);
}

void Homing::resume(Time now) {
  if (in_progress()) end(Phase::kFailed, Ramp::kQuickStop, now);
}

void Homing::run(const ModeInput& input, Time now) {
  const bool bit = input.has(controlword::kStartHoming);
  const bool halt = input.has(controlword::kHalt);
  const bool begins = (bit && !bit_before_) || phase_ == Phase::kHalted;
  bit_before_ = bit;
  if (begins) {
    phase_ = bit ? Phase::kHalted : Phase::kIdle;
    if (bit && !halt) start(now);
  }
  if (!in_progress()) return;
  if (!bit || halt) return end(bit ? Phase::kHalted : Phase::kIdle, halt_ramp(), now);
  if (input.barred(direction_)) return end(Phase::kFailed, Ramp::kQuickStop, now);
  if (phase_ == Phase::kSearching && now >= leg_ends_) next_leg(now);
  if (phase_ == Phase::kToHome && axis_.over(now)) {
    axis_.set_position(-axis_.increments(objects_.home_offset.get()), now);
    phase_ = Phase::kAttained;
  }
}

void Homing::start(Time now) {
  const std::int8_t method = objects_.homing_method.get();
  if (!is_homing_method(method)) return end(Phase::kFailed, Ramp::kSlowDown, now);
  if (method == kNoHoming) return end(Phase::kAttained, Ramp::kSlowDown, now);
  const double place = axis_.to_machine(axis_.demand(now).position);
  way_ = homing_way(method, place, axis_.layout(), axis_.index_pitch());
  leg_ = 0;
  phase_ = Phase::kSearching;
  next_leg(now);
}

void Homing::next_leg(Time now) {
  const double acceleration = axis_.increments_per_second(objects_.homing_acceleration.get());
  if (leg_ == way_.legs.size()) {
    if (way_.hard && leg_ != 0) axis_.line_to(axis_.from_machine(way_.legs.back().until), 0, now);
    if (way_.blind) return end(Phase::kFailed, Ramp::kQuickStop, now);
    const double speed = axis_.increments_per_second(objects_.homing_speed_zero.get());
    const double home = std::round(axis_.from_machine(way_.home));
    direction_ = home - axis_.demand(now).position;
    axis_.move_to(home, {std::min(speed, axis_.max_velocity()), acceleration, acceleration}, now);
    phase_ = Phase::kToHome;
    leg_ends_ = kNever;
    return;
  }
  const HomingLeg& leg = way_.legs[leg_++];
  direction_ = leg.direction;
  const double speed =
      std::min(axis_.increments_per_second(objects_.homing_speed_switch.get()), axis_.max_velocity());
  const bool turns = axis_.demand(now).velocity * leg.direction < 0;
  axis_.run_at(leg.direction * speed, acceleration, acceleration, now);
  // The edge just passed is passed again on the way back; the second passage counts.
  const Time from = turns ? axis_.profile().next_change(now) : now;
  leg_ends_ = axis_.profile().time_at(axis_.from_machine(leg.until), from);
}

void Homing::end(Phase phase, Ramp ramp, Time now) {
  phase_ = phase;
  leg_ends_ = kNever;
  axis_.stop(ramp, now);
}

std::uint16_t Homing::status(Time now) const {
  std::uint16_t bits = 0;
  if (!in_progress() && axis_.at_rest(now)) bits |= statusword::kTargetReached;
  if (phase_ == Phase::kAttained) bits |= statusword::kHomingAttained;
  if (phase_ == Phase::kFailed) bits |= statusword::kHomingError;
  return bits;
}

}  // namespace cbcan::devices

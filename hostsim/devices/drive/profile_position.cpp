// SPDX-License-Identifier: MIT
#include "devices/drive/modes.hpp"

#include <cmath>

#include "sim/number.hpp"

namespace cbcan::devices {

namespace {

// Fields of 60F2h.
constexpr std::uint16_t kRelativeOption = 0x0003;
constexpr std::uint16_t kToDemand = 0x0001;
constexpr std::uint16_t kToActual = 0x0002;
constexpr std::uint16_t kRotaryOption = 0x00C0;
constexpr std::uint16_t kNegative = 0x0040;
constexpr std::uint16_t kPositive = 0x0080;
constexpr std::uint16_t kShortest = 0x00C0;

/// Increments: a target this near needs no turn.
constexpr double kHere = 0.5;

}  // namespace

void ProfilePosition::enter(const ModeInput& input, Time now) {
  next_.reset();
  pass_at_ = kNever;
  has_target_ = go_ = held_ = halted_ = limited_ = acknowledged_ = false;
  bit_before_ = input.has(controlword::kNewSetPoint);
  axis_.stop(Ramp::kSlowDown, now);
}

void ProfilePosition::run(const ModeInput& input, Time now) {
  const bool bit = input.has(controlword::kNewSetPoint);
  if (now >= pass_at_ || (next_ && !held_ && axis_.at_rest(now))) begin(*next_, now);
  if (bit && !bit_before_) take(input, now);
  if (!bit) acknowledged_ = false;
  bit_before_ = bit;
  hold_or_go(input, now);
}

void ProfilePosition::take(const ModeInput& input, Time now) {
  const SetPoint set_point{axis_.increments(objects_.target_position.get()),
                           input.has(controlword::kRelative), axis_.profile_dynamics()};
  const bool in_progress = has_target_ && (held_ || go_ || !axis_.at_rest(now));
  if (input.has(controlword::kChangeImmediately) || !in_progress) {
    begin(set_point, now);
  } else {
    if (next_) return;
    next_ = set_point;
    if (input.has(controlword::kChangeOnSetPoint)) pass_through(now);
  }
  acknowledged_ = true;
}

void ProfilePosition::begin(const SetPoint& set_point, Time now) {
  const double here = axis_.demand(now).position;
  const double wanted = target_of(set_point, base(now));
  double target = axis_.within_limits(wanted);
  limited_ = target != wanted;
  if (!set_point.relative) target = way_round(target, here);
  dynamics_ = set_point.dynamics;
  direction_ = target - here;
  axis_.aim_at(target);
  next_.reset();
  pass_at_ = kNever;
  has_target_ = go_ = true;
}

/// What relative set-points count from.
double ProfilePosition::base(Time now) const {
  switch (objects_.positioning_option.get() & kRelativeOption) {
    case kToDemand: return axis_.demand(now).position;
    case kToActual: return axis_.actual(now).position;
    default: return has_target_ ? axis_.target() : axis_.demand(now).position;
  }
}

/// The same position of a rotary axis, in the direction of 60F2h.
double ProfilePosition::way_round(double target, double from) const {
  if (!axis_.goes_round()) return target;
  const double once = axis_.circumference();
  const double way = target - from;
  switch (objects_.positioning_option.get() & kRotaryOption) {
    case kNegative: return target - std::ceil((way - kHere) / once) * once;
    case kPositive: return target - std::floor((way + kHere) / once) * once;
    case kShortest: return target - std::round(way / once) * once;
    default: return target;
  }
}

double ProfilePosition::target_of(const SetPoint& set_point, double base) const {
  return std::round((set_point.relative ? base : 0) + set_point.target);
}

/// Continues at profile velocity; the next set-point begins when this one is passed.
void ProfilePosition::pass_through(Time now) {
  const double target = axis_.target();
  if (held_ || axis_.profile().time_at(target, now) == kNever) return;
  const double direction = target < axis_.demand(now).position ? -1.0 : 1.0;
  const double beyond = direction * (axis_.within_limits(target_of(*next_, target)) - target);
  const double braking = dynamics_.velocity * dynamics_.velocity / (2 * next_->dynamics.deceleration);
  if (!(beyond >= braking)) return;
  axis_.run_at(direction * dynamics_.velocity, dynamics_.acceleration, dynamics_.deceleration, now);
  pass_at_ = axis_.profile().time_at(target, now);
}

void ProfilePosition::hold_or_go(const ModeInput& input, Time now) {
  halted_ = input.has(controlword::kHalt);
  if (!held_ && !go_ && axis_.at_rest(now)) direction_ = 0;
  const bool barred = has_target_ && input.barred(direction_);
  const bool hold = halted_ || barred;
  if (hold && !held_) {
    axis_.stop(halted_ ? halt_ramp() : Ramp::kQuickStop, now);
    pass_at_ = kNever;
  }
  const bool released = held_ && !hold;
  held_ = hold;
  if (!held_ && has_target_ && (go_ || released)) {
    axis_.move_to(axis_.target(), dynamics_, now);
    go_ = false;
  }
}

void ProfilePosition::resume(Time now) {
  if (has_target_ && !held_) axis_.move_to(axis_.target(), dynamics_, now);
  pass_at_ = kNever;
}

bool ProfilePosition::reached(Time now) const {
  if (halted_ || !has_target_) return axis_.at_rest(now);
  if (held_ || next_ || !axis_.over(now)) return false;
  const std::uint32_t window = objects_.position_window.get();
  const double actual = axis_.actual(now).position;
  if (window == DriveObjects::kNoLimit)
    return sim::rounded<std::int32_t>(axis_.user(actual)) ==
           sim::rounded<std::int32_t>(axis_.user(axis_.target()));
  const double distance = std::abs(axis_.target() - actual);
  return distance <= axis_.increments(window) && now >= reached_at();
}

Time ProfilePosition::reached_at() const {
  return axis_.profile().end() + milliseconds(objects_.position_window_time.get());
}

std::uint16_t ProfilePosition::status(Time now) const {
  std::uint16_t bits = 0;
  if (reached(now)) bits |= statusword::kTargetReached;
  if (limited_ || (held_ && !halted_)) bits |= statusword::kInternalLimit;
  if (acknowledged_ || next_) bits |= statusword::kSetPointAcknowledge;
  return bits;
}

Time ProfilePosition::deadline(Time now) const {
  const Time window = axis_.over(now) && reached_at() > now ? reached_at() : kNever;
  return earlier(pass_at_, window);
}

}  // namespace cbcan::devices

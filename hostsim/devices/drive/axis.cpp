// SPDX-License-Identifier: MIT
#include "devices/drive/axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace cbcan::devices {

namespace {

constexpr Time kStep = kMillisecond;
constexpr double kSeconds = 1e-3;
/// Bandwidth of the critically damped controller, in rad/s: 30 Hz.
constexpr double kBandwidth = 188;
/// Increments, and increments per second: too small to be visible.
constexpr double kStill = 1e-3;
/// 1 mNm at 1 kg cm2, in rad/s2.
constexpr double kPerInertia = 10;

double sign(double value) {
  return value < 0 ? -1 : value > 0 ? 1 : 0;
}

constexpr double kSecondsPerMinute = 60;

/// Increments: clearly on one side of an edge.
constexpr double kBeside = 1e-3;
constexpr double kFarFrom = 1;
constexpr double kNowhere = std::numeric_limits<double>::infinity();
constexpr std::int32_t kLowest = std::numeric_limits<std::int32_t>::min();
constexpr std::int32_t kHighest = std::numeric_limits<std::int32_t>::max();

constexpr std::int8_t kVl = 2;

constexpr double limit(std::uint32_t value) {
  return value == 0 ? DriveObjects::kNoLimit : value;
}

}  // namespace

void Load::reset(double position, Time now) {
  position_ = position;
  velocity_ = torque_ = 0;
  limited_ = false;
  at_ = now / kStep * kStep;
  settled_ = false;
}

void Load::follow(const Lead& lead, Time now) {
  for (; !settled_ && at_ + kStep <= now; at_ += kStep)
    step(lead);
  if (settled_) at_ = now / kStep * kStep;
}

/// Increments per second squared, after friction and gravity.
double Load::acceleration(double torque) const {
  const double friction = thousandths(load_.friction);
  const double net = torque - thousandths(load_.gravity);
  const double direction = velocity_ != 0 ? sign(velocity_) : sign(net);
  if (velocity_ == 0 && std::abs(net) <= friction) return 0;
  return (net - direction * friction) * rated_ / 1000 * kPerInertia / load_.inertia * per_radian_;
}

/// The torque that brings the load to the demand by the end of the step.
double Load::wanted_torque(const Lead& lead, Time end) const {
  if (lead.torque != nullptr) return lead.torque->at(end).velocity;
  if (lead.demand == nullptr) return 0;
  const Motion demand = lead.demand->at(end);
  const double lag = demand.position - position_ - velocity_ * kSeconds;
  constexpr double kPhase = kBandwidth * kSeconds;
  const double wanted =
      kBandwidth * (kBandwidth * lag + 2 * (demand.velocity - velocity_)) /
      (1 + 2 * kPhase + kPhase * kPhase / 2);  // the step itself already reduces lag and velocity error
  const double direction = velocity_ != 0 ? sign(velocity_) : sign(wanted);
  return thousandths(load_.gravity + direction * load_.friction +
                     wanted * load_.inertia / (kPerInertia * per_radian_));
}

void Load::step(const Lead& lead) {
  const Time end = at_ + kStep;
  const double wanted = wanted_torque(lead, end);
  torque_ = std::clamp(wanted, -lead.most_torque, lead.most_torque);
  limited_ = torque_ != wanted;
  if (lead.held) {
    velocity_ = 0;
    settled_ = lead.demand == nullptr || end >= lead.demand->end();
    return;
  }
  const double before = velocity_;
  double after = before + acceleration(torque_) * kSeconds;
  const bool sticks = std::abs(torque_ - thousandths(load_.gravity)) <= thousandths(load_.friction);
  if (sticks && before * after < 0) after = 0;
  velocity_ = after;
  position_ += (before + after) / 2 * kSeconds;
  if (position_ < lead.low || position_ > lead.high) {
    position_ = std::clamp(position_, lead.low, lead.high);
    velocity_ = 0;
  }
  settled_ = rests(lead, end);
  if (!settled_ || lead.demand == nullptr) return;
  position_ = lead.demand->at(end).position;
  velocity_ = 0;
  torque_ = thousandths(load_.gravity);
  limited_ = false;
}

/// True at the end of a step: the load will not change until the lead does.
bool Load::rests(const Lead& lead, Time end) const {
  if (lead.demand != nullptr) {
    const bool is_over = end >= lead.demand->end() && lead.demand->final_velocity() == 0;
    return is_over && std::abs(lead.demand->at(end).position - position_) < kStill &&
           std::abs(velocity_) < kStill;
  }
  const bool at_a_stop = (position_ <= lead.low && torque_ < thousandths(load_.gravity)) ||
                         (position_ >= lead.high && torque_ > thousandths(load_.gravity));
  const bool is_steady = lead.torque == nullptr || end >= lead.torque->end();
  return is_steady && velocity_ == 0 && (at_a_stop || acceleration(torque_) == 0);
}

Motion Load::at(Time now) const {
  if (settled_ || now <= at_) return {position_, velocity_};
  return {position_ + velocity_ * static_cast<double>(now - at_) / kSecond, velocity_};
}

Time Load::next_change(Time now) const {
  return settled_ || !exists() ? kNever : (now / kStep + 1) * kStep;
}

void Axis::reset(Time now) {
  take_over_units();
  place_home_switch();
  const double here = actual(now).position;
  zero_ -= here;
  blocked_at_ = 0;
  target_ = 0;
  profile_ = Profile(0);
  torque_ = nullptr;
  led_ = !load_.exists();
  load_.reset(0, now);
}

/// Where the plant file has not placed it, within a narrower 607Dh.
void Axis::place_home_switch() {
  constexpr AxisLayout kStandard;
  const double end = increments(objects_.limit_max.get());
  if (!has_limits() || end <= 0 || end >= kStandard.home_high) return;
  if (layout_.home_low != kStandard.home_low || layout_.home_high != kStandard.home_high) return;
  layout_.home_low = 0.8 * end;
  layout_.home_high = end;
}

Load::Lead Axis::lead() const {
  return {led_ ? &profile_ : nullptr,
          torque_,
          blocked_,
          led_ || torque_ != nullptr ? most_torque() : 0,
          from_machine(negative_limit() - layout_.stops_beyond),
          from_machine(positive_limit() + layout_.stops_beyond)};
}

void Axis::drive(bool powered, const Profile* torque, Time now) {
  const bool led = powered && torque == nullptr;
  const Profile* const torque_now = powered ? torque : nullptr;
  if (torque_now != nullptr && std::exchange(torque_end_, torque_now->end()) != torque_end_) load_.wake();
  if (led == led_ && torque_now == torque_) return;
  if (led && profile_since_ != now) profile_ = Profile(actual(now).position);
  led_ = led;
  torque_ = torque_now;
  load_.wake();
}

void Axis::follow_profile(const Profile& profile, Time now) {
  carry(now);
  profile_ = profile;
  profile_since_ = now;
  load_.wake();
}

double Axis::most_torque() const {
  const std::uint16_t torque = objects_.max_torque.get();
  const std::uint16_t current = objects_.max_current.get();
  return current == 0 ? torque : std::min(torque, current);
}

void Axis::take_over_units() {
  const UnitFactors factors{
      {objects_.encoder.up.get(), objects_.encoder.down.get()},
      {objects_.gear.up.get(), objects_.gear.down.get()},
      {objects_.feed.up.get(), objects_.feed.down.get()},
      {objects_.position_factor.up.get(), objects_.position_factor.down.get()},
      {objects_.velocity_encoder_factor.up.get(), objects_.velocity_encoder_factor.down.get()},
      {objects_.velocity_factor.up.get(), objects_.velocity_factor.down.get()},
      objects_.si_unit_position.get(),
      objects_.si_unit_velocity.get(),
      {objects_.position_notation.get(), objects_.position_dimension.get()},
      {objects_.velocity_notation.get(), objects_.velocity_dimension.get()},
      layout_.si_position(),
      layout_.si_velocity(),
  };
  if (factors != factors_) {
    factors_ = factors;
    units_ = Units(factors);
  }
  if (!load_.exists()) return;
  constexpr double kNothingRated = 1000;  // mNm
  const double rated = objects_.rated_torque.get();
  load_.set_units(units_.increments_per_revolution() / (2 * std::numbers::pi),
                  rated == 0 ? kNothingRated : rated);
}

void Axis::refresh(Time now) {
  carry(now);
  take_over_units();
  if (load_.exists() && std::exchange(most_before_, most_torque()) != most_before_) load_.wake();
  const Profile::Range range = position_range();
  const double position = user(demand(now).position);
  if (position >= range.low && position < range.high) return;
  const double span = range.high - range.low;
  shift(-increments(std::floor((position - range.low) / span) * span));
}

/// Limits in user-defined units, including positions that are rounded to its ends.
Profile::Range Axis::position_range() const {
  const std::int32_t low = objects_.range_min.get();
  const std::int32_t high = objects_.range_max.get();
  return low < high ? Profile::Range{low - 0.5, high + 0.5} : Profile::Range{kLowest - 0.5, kHighest + 0.5};
}

bool Axis::just_moves() const {
  if (blocked_ || load_.exists()) return false;
  const Profile::Range range = position_range();
  const Profile::Range way = profile_.range();
  return user(way.low) >= range.low && user(way.high) < range.high;
}

void Axis::shift(double distance) {
  profile_.shift(distance);
  target_ += distance;
  zero_ += distance;
  blocked_at_ += distance;
  load_.shift(distance);
}

void Axis::move_to(double target, const Dynamics& dynamics, Time now) {
  target_ = target;
  follow_profile(Profile::to_position(demand(now), target, dynamics, now), now);
}

void Axis::run_at(double velocity, double acceleration, double deceleration, Time now) {
  follow_profile(Profile::to_velocity(demand(now), velocity, acceleration, deceleration, now), now);
}

void Axis::line_to(double target, Time duration, Time now) {
  target_ = target;
  follow_profile(Profile::line(demand(now).position, target, duration, now), now);
}

void Axis::change_evenly_to(double velocity, Time duration, Time now) {
  follow_profile(Profile::even_change(demand(now), velocity, duration, now), now);
}

double Axis::deceleration(Ramp ramp) const {
  const bool is_slow = ramp == Ramp::kSlowDown;
  if (objects_.mode_display.get() == kVl)
    return slope(is_slow ? objects_.vl_deceleration : objects_.vl_quick_stop);
  return increments_per_second(is_slow ? objects_.profile_deceleration.get()
                                       : objects_.quick_stop_deceleration.get());
}

void Axis::give_up_demand(Time now) {
  if (blocked_ || load_.exists()) follow_profile(Profile(actual(now).position), now);
}

void Axis::set_blocked(bool blocked, Time now) {
  if (blocked == blocked_) return;
  carry(now);
  if (blocked) {
    blocked_at_ = actual(now).position;
  } else {
    give_up_demand(now);
  }
  blocked_ = blocked;
  load_.reset(blocked_at_, now);
}

Dynamics Axis::profile_dynamics() const {
  return {std::min(increments_per_second(objects_.profile_velocity.get()), max_velocity()),
          increments_per_second(objects_.profile_acceleration.get()),
          increments_per_second(objects_.profile_deceleration.get())};
}

double Axis::max_velocity() const {
  const double profile = increments_per_second(limit(objects_.max_profile_velocity.get()));
  if (!units_.knows_revolutions()) return profile;
  return std::min(profile, per_minute(limit(objects_.max_motor_speed.get())));
}

double Axis::per_minute(double revolutions) const {
  return revolutions / kSecondsPerMinute * units_.increments_per_revolution();
}

double Axis::from_vl(double velocity) const {
  return per_minute(velocity * objects_.vl_dimension_factor.value());
}

double Axis::slope(const DriveObjects::Slope& slope) const {
  return slope.time.get() == 0 ? 0 : std::abs(from_vl(slope.speed.get())) / slope.time.get();
}

bool Axis::goes_round() const {
  const std::int32_t low = objects_.range_min.get();
  const std::int32_t high = objects_.range_max.get();
  return low < high && (low != kLowest || high != kHighest);
}

double Axis::circumference() const {
  const Profile::Range range = position_range();
  return increments(range.high - range.low);
}

double Axis::negative_limit() const {
  return goes_round() ? -kNowhere : layout_.negative_limit.value_or(-kNowhere);
}

double Axis::positive_limit() const {
  return goes_round() ? kNowhere : layout_.positive_limit.value_or(kNowhere);
}

AxisSwitches Axis::switches(Time now) const {
  const double place = this->place(now);
  return {place <= negative_limit(), place >= positive_limit(),
          place >= layout_.home_low && place <= layout_.home_high};
}

Time Axis::next_switch(Time now) const {
  if (blocked_ || load_.exists() || at_rest(now)) return kNever;
  Time next = kNever;
  const Profile::Range range = profile_.range();
  for (const double edge : {negative_limit(), positive_limit(), layout_.home_low, layout_.home_high})
    next = earlier(next, passes_beside(from_machine(edge), range, now));
  if (!has_limits()) return next;
  for (const double end : {objects_.limit_min.get() - 0.5, objects_.limit_max.get() + 0.5})
    next = earlier(next, passes_beside(increments(end), range, now));
  return next;
}

/// Looks at either side; `range` is that of the profile.
Time Axis::passes_beside(double position, const Profile::Range& range, Time now) const {
  if (std::isinf(position) || position < range.low - kFarFrom || position > range.high + kFarFrom)
    return kNever;
  return earlier(passes(position - kBeside, now), passes(position + kBeside, now));
}

Time Axis::passes(double position, Time now) const {
  const Time at = profile_.time_at(position, now);
  return at > now ? at : kNever;
}

bool Axis::is_outside_limits(Time now) const {
  if (!has_limits()) return false;
  const double position = std::round(user(from_machine(place(now))));
  return position < objects_.limit_min.get() || position > objects_.limit_max.get();
}

double Axis::within_limits(double position) const {
  if (!has_limits()) return position;
  return std::clamp(position, increments(objects_.limit_min.get()), increments(objects_.limit_max.get()));
}

}  // namespace cbcan::devices

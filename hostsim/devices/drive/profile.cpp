// SPDX-License-Identifier: MIT
#include "devices/drive/profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace cbcan::devices {

namespace {

// Bytes of 60A8h and 60A9h, most significant first: prefix, numerator, denominator, 0 (CiA 303-2).
constexpr int prefix_of(std::uint32_t unit) {
  return static_cast<std::int8_t>(unit >> 24);
}
constexpr std::uint8_t numerator_of(std::uint32_t unit) {
  return static_cast<std::uint8_t>(unit >> 16);
}
constexpr std::uint8_t denominator_of(std::uint32_t unit) {
  return static_cast<std::uint8_t>(unit >> 8);
}

constexpr std::uint8_t kMetre = 0x01;
constexpr std::uint8_t kSecond = 0x03;
constexpr std::uint8_t kDegree = 0x41;
constexpr std::uint8_t kMinute = 0x47;
constexpr std::uint8_t kHour = 0x48;
constexpr std::uint8_t kRevolution = 0xB4;
constexpr std::uint8_t kIncrement = 0xB5;

double seconds_in(std::uint32_t unit) {
  return denominator_of(unit) == kMinute ? 60 : denominator_of(unit) == kHour ? 3600 : 1;
}

constexpr double kSecondsPerTick = 1e-6;
/// Used for an acceleration of 0, which means without a ramp.
constexpr double kAtOnce = 1e15;
/// Ticks: the rounding error allowed in a time that is a whole number of ticks.
constexpr double kSameTick = 1e-3;
/// Increments; two positions closer than this are equal.
constexpr double kSamePosition = 1e-6;
constexpr double kNotReached = std::numeric_limits<double>::infinity();

double usable(double acceleration) {
  return acceleration > 0 ? acceleration : kAtOnce;
}

double sign_of(double value) {
  return value < 0 ? -1.0 : 1.0;
}

/// A time in the far future is kNever.
Time ticks_after(Time start, double seconds) {
  constexpr double kFar = 1e18;
  const double ticks = std::ceil(seconds / kSecondsPerTick - kSameTick);
  return ticks < kFar ? start + static_cast<Time>(ticks) : kNever;
}

/// A unit of DSP 402 V2.
struct Dimension {
  std::uint8_t index, numerator, denominator;
};
constexpr auto kDimensions = std::to_array<Dimension>({{0x01, kMetre, 0},
                                                       {0x41, kDegree, 0},
                                                       {0xA3, kRevolution, kSecond},
                                                       {0xA4, kRevolution, kMinute},
                                                       {0xA5, kRevolution, kHour},
                                                       {0xA6, kMetre, kSecond},
                                                       {0xA7, kMetre, kMinute},
                                                       {0xA8, kMetre, kHour},
                                                       {0xAC, kIncrement, 0}});

/// A value of 60A8h or 60A9h; 0 = it names no unit of positions or velocities.
std::uint32_t si_unit(const NamedDimension& named) {
  const auto unit = std::ranges::find(kDimensions, named.dimension, &Dimension::index);
  if (unit == kDimensions.end()) return 0;
  return std::uint32_t{static_cast<std::uint8_t>(named.notation)} << 24 |
         std::uint32_t{unit->numerator} << 16 | std::uint32_t{unit->denominator} << 8;
}

/// The first of them that names a unit.
std::uint32_t named_unit(std::uint32_t si_unit_of_file, const NamedDimension& older, std::uint32_t of_plant) {
  if (si_unit_of_file != 0) return si_unit_of_file;
  const std::uint32_t named = si_unit(older);
  return named != 0 ? named : of_plant;
}

}  // namespace

Units::Factor Units::Factor::times_ten_to(int exponent) const {
  const double power = std::pow(10.0, std::abs(exponent));
  return exponent < 0 ? times(1, power) : times(power, 1);
}

Units::Factor Units::size_of(std::uint32_t unit, const Factor& shaft) {
  const Factor size = Factor{}.times_ten_to(prefix_of(unit));
  switch (numerator_of(unit)) {
    case kIncrement: return size;
    case kRevolution: return size.times(shaft.up, shaft.down);
    case kDegree: return size.times(shaft.up, shaft.down * 360);
    default: return {0, 1};
  }
}

Units::Units(const UnitFactors& given) {
  UnitFactors factors = given;
  factors.si_position = named_unit(given.si_position, given.older_position, given.position_of_plant);
  factors.si_velocity = named_unit(given.si_velocity, given.older_velocity, given.velocity_of_plant);
  const Factor encoder = Factor{}.times(factors.encoder);
  knows_revolutions_ = encoder.up > encoder.down;
  const Factor turn = knows_revolutions_ ? encoder : Factor{kNominalResolution, 1};
  increments_per_revolution_ = turn.up / turn.down;
  const Factor shaft = turn.times(factors.gear);
  const Factor named = size_of(factors.si_position, shaft);
  if (factors.position.is_other_than_1())
    position_ = Factor{}.times(factors.position);
  else if (!factors.feed.is_other_than_1() && named.up != 0)
    position_ = named;
  else if (factors.feed.is_other_than_1() || !factors.position.counts())
    position_ = encoder.times(factors.gear).times({factors.feed.down, factors.feed.up});
  velocity_ = velocity_of(factors, shaft);
}

Units::Factor Units::velocity_of(const UnitFactors& factors, const Factor& shaft) {
  if (factors.velocity_encoder.is_other_than_1()) return Factor{}.times(factors.velocity_encoder);
  if (factors.velocity.is_other_than_1())
    return position_.times({factors.velocity.down, factors.velocity.up});
  const std::uint32_t unit = factors.si_velocity;
  Factor named = size_of(unit, shaft);
  if (named.up != 0) {
    knows_revolutions_ |= numerator_of(unit) != kIncrement;
  } else {  // a unit such as metres: as in 60A8h
    const bool is_same = numerator_of(unit) != 0 && numerator_of(unit) == numerator_of(factors.si_position);
    if (!is_same) return position_;
    named = position_.times_ten_to(prefix_of(unit) - prefix_of(factors.si_position));
  }
  return named.times(1, seconds_in(unit));
}

void Profile::append(double duration, double acceleration, double end_velocity) {
  if (!(duration > 0)) return;
  phases_[count_++] = {ticks_after(start_, length_), length_, last_.position, last_.velocity, acceleration};
  last_.position += duration * (last_.velocity + end_velocity) / 2;
  last_.velocity = end_velocity;
  length_ += duration;
}

void Profile::finish(double position, double velocity) {
  end_ = ticks_after(start_, length_);
  phases_[count_++] = {end_, length_, position, velocity, 0};
}

Profile Profile::to_position(const Motion& from, double target, const Dynamics& dynamics, Time start) {
  const double deceleration = usable(dynamics.deceleration);
  Profile profile(from, start);
  const double speed = std::abs(from.velocity);
  const double stop = from.position + from.velocity * speed / (2 * deceleration);
  const bool moves = dynamics.velocity > 0;
  const bool passes = (target - stop) * from.velocity < 0 || std::abs(target - stop) < kSamePosition;
  if (passes || !moves) profile.append(speed / deceleration, -sign_of(from.velocity) * deceleration, 0);
  const bool there = std::abs(target - profile.last_.position) < kSamePosition;
  if (moves && !there) profile.travel(target, dynamics);
  profile.finish(moves || there ? target : profile.last_.position, 0);
  return profile;
}

/// Starts at a standstill, or from motion towards a target that is far enough to stop there.
void Profile::travel(double target, const Dynamics& dynamics) {
  const double acceleration = usable(dynamics.acceleration);
  const double deceleration = usable(dynamics.deceleration);
  const double direction = sign_of(target - last_.position);
  const double distance = std::abs(target - last_.position);
  const double entry = std::abs(last_.velocity);
  const double peak = std::sqrt((distance + entry * entry / (2 * acceleration)) * 2 * acceleration *
                                deceleration / (acceleration + deceleration));
  const double cruise = std::min(std::max(peak, entry), dynamics.velocity);
  const double change = entry > cruise ? -deceleration : acceleration;
  append((cruise - entry) / change, direction * change, direction * cruise);
  const double braking = cruise * cruise / (2 * deceleration);
  append((direction * (target - last_.position) - braking) / cruise, 0, direction * cruise);
  append(cruise / deceleration, -direction * deceleration, 0);
}

Profile Profile::to_velocity(const Motion& from, double velocity, double acceleration, double deceleration,
                             Time start) {
  Profile profile(from, start);
  const bool turns = from.velocity * velocity < 0;
  const bool slower = std::abs(velocity) < std::abs(from.velocity);
  if (turns || slower) {
    const double rate = usable(deceleration);
    const double until = turns ? 0 : velocity;
    profile.append(std::abs(until - from.velocity) / rate, -sign_of(from.velocity) * rate, until);
  }
  const double rate = usable(acceleration);
  const double change = velocity - profile.last_.velocity;
  profile.append(std::abs(change) / rate, sign_of(change) * rate, velocity);
  profile.finish(profile.last_.position, velocity);
  return profile;
}

Profile Profile::line(double from, double target, Time duration, Time start) {
  Profile profile({from, 0}, start);
  const double seconds = static_cast<double>(duration) * kSecondsPerTick;
  if (duration != 0) {
    profile.last_.velocity = (target - from) / seconds;
    profile.append(seconds, 0, profile.last_.velocity);
  }
  profile.finish(target, 0);
  return profile;
}

Profile Profile::even_change(const Motion& from, double velocity, Time duration, Time start) {
  Profile profile(from, start);
  const double seconds = static_cast<double>(duration) * kSecondsPerTick;
  if (duration != 0) profile.append(seconds, (velocity - from.velocity) / seconds, velocity);
  profile.finish(profile.last_.position, velocity);
  return profile;
}

double Profile::seconds_at(Time now) const {
  return now > start_ ? static_cast<double>(now - start_) * kSecondsPerTick : 0;
}

std::size_t Profile::phase_at(Time now) const {
  std::size_t i = count_ - 1;
  while (i > 0 && phases_[i].begins > now)
    --i;
  return i;
}

void Profile::know(Time now) const {
  const Phase& phase = phases_[phase_at(now)];
  const double t = std::max(seconds_at(now) - phase.begin, 0.0);
  known_ = {phase.position + t * (phase.velocity + t * phase.acceleration / 2),
            phase.velocity + t * phase.acceleration};
  known_at_ = now;
}

Time Profile::next_change(Time now) const {
  const std::size_t next = phase_at(now) + 1;
  return next < count_ ? phases_[next].begins : kNever;
}

Time Profile::steady_since(Time now) const {
  const Phase& phase = phases_[phase_at(now)];
  return phase.acceleration == 0 ? phase.begins : kNever;
}

Profile::Range Profile::range() const {
  Range all{phases_[0].position, phases_[0].position};
  bool known = final_velocity() == 0;
  for (const Phase& phase : std::span(phases_).first(count_)) {
    known &= phase.acceleration == 0;
    all = {std::min(all.low, phase.position), std::max(all.high, phase.position)};
  }
  return known ? all : Range{-kNotReached, kNotReached};
}

/// Seconds after the start at which the phase is at `position`, not before `from` and not after `until`.
double Profile::first_reach(const Phase& phase, double position, double from, double until) const {
  const double distance = position - phase.position;
  std::array<double, 2> candidates = {kNotReached, kNotReached};
  if (phase.acceleration == 0) {
    if (phase.velocity != 0) candidates[0] = distance / phase.velocity;
  } else {
    const double square = phase.velocity * phase.velocity + 2 * phase.acceleration * distance;
    if (square < 0) return kNotReached;
    const double root = std::sqrt(square);
    candidates = {(-phase.velocity - root) / phase.acceleration,
                  (-phase.velocity + root) / phase.acceleration};
    if (candidates[0] > candidates[1]) std::swap(candidates[0], candidates[1]);
  }
  for (const double t : candidates)
    if (phase.begin + t >= from && phase.begin + t <= until) return phase.begin + t;
  return kNotReached;
}

Time Profile::time_at(double position, Time from) const {
  const double earliest = seconds_at(from);
  for (std::size_t i = 0; i < count_; ++i) {
    const double until = i + 1 < count_ ? phases_[i + 1].begin : kNotReached;
    if (until < earliest) continue;
    const double reached = first_reach(phases_[i], position, std::max(earliest, phases_[i].begin), until);
    if (reached < kNotReached) return std::max(from, ticks_after(start_, reached));
    // Rounding may hide a stop exactly at the position: it is reached at the end.
    if (i + 1 == count_ && std::abs(position - phases_[i].position) < kSamePosition)
      return std::max(from, end_);
  }
  return kNever;
}

void Profile::shift(double distance) {
  for (std::size_t i = 0; i < count_; ++i)
    phases_[i].position += distance;
  known_at_ = kNever;
}

}  // namespace cbcan::devices

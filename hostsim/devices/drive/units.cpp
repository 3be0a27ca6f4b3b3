// SPDX-License-Identifier: MIT
#include "devices/drive/units.hpp"

#include <cmath>

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

constexpr std::uint8_t kDegree = 0x41;
constexpr std::uint8_t kMinute = 0x47;
constexpr std::uint8_t kRevolution = 0xB4;
constexpr std::uint8_t kIncrement = 0xB5;

double seconds_in(std::uint32_t unit) {
  return denominator_of(unit) == kMinute ? 60 : 1;
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

Units::Units(const UnitFactors& factors) {
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

}  // namespace cbcan::devices

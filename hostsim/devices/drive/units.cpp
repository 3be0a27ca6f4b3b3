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

Ratio ten_to(int exponent) {
  const double power = std::pow(10.0, std::abs(exponent));
  return exponent < 0 ? Ratio{1, power} : Ratio{power, 1};
}

/// Increments in one unit of 60A8h or 60A9h; up = 0: not a unit of rotation.
Ratio size_in_increments(std::uint32_t unit, const Ratio& shaft) {
  const Ratio size = ten_to(prefix_of(unit));
  switch (numerator_of(unit)) {
    case kIncrement: return size;
    case kRevolution: return size.times(shaft);
    case kDegree: return size.times(shaft).times({1, 360});
    default: return {0, 1};
  }
}

}  // namespace

Units::Units(const UnitFactors& factors) {
  const Ratio encoder = Ratio{1, 1}.times(factors.encoder);
  knows_revolutions_ = encoder.up > encoder.down;
  const Ratio turn = knows_revolutions_ ? encoder : Ratio{kNominalResolution, 1};
  increments_per_revolution_ = turn.up / turn.down;
  const Ratio shaft = turn.times(factors.gear);
  const Ratio named = size_in_increments(factors.si_position, shaft);
  if (factors.position.is_other_than_1())
    position_ = factors.position;
  else if (!factors.feed.is_other_than_1() && named.up != 0)
    position_ = named;
  else if (factors.feed.is_other_than_1() || !factors.position.counts())
    position_ = encoder.times(factors.gear).times({factors.feed.down, factors.feed.up});
  velocity_ = velocity_of(factors, shaft);
}

Ratio Units::velocity_of(const UnitFactors& factors, const Ratio& shaft) {
  if (factors.velocity_encoder.is_other_than_1()) return factors.velocity_encoder;
  if (factors.velocity.is_other_than_1())
    return position_.times({factors.velocity.down, factors.velocity.up});
  const std::uint32_t unit = factors.si_velocity;
  Ratio named = size_in_increments(unit, shaft);
  if (named.up != 0) {
    knows_revolutions_ |= numerator_of(unit) != kIncrement;
  } else {  // a unit such as metres: as in 60A8h
    const bool is_same = numerator_of(unit) != 0 && numerator_of(unit) == numerator_of(factors.si_position);
    if (!is_same) return position_;
    named = position_.times(ten_to(prefix_of(unit) - prefix_of(factors.si_position)));
  }
  return named.times({1, seconds_in(unit)});
}

}  // namespace cbcan::devices

// SPDX-License-Identifier: MIT
#include "devices/drive/modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace cbcan::devices {

namespace {

constexpr std::int8_t kWithoutIndex = 16;  ///< method n + 16 is method n without index pulse
constexpr double kUp = 1;
constexpr double kDown = -1;

enum class Edge : std::uint8_t { kLow, kHigh };  ///< of the home switch

/// Methods 3..14 and 19..30.
struct HomeSwitchMethod {
  std::int8_t method;
  Edge edge;
  double last_direction;   ///< in which the edge is found
  double first_direction;  ///< in which the search for the switch begins
  bool turns_at_limit;
};

constexpr auto kHomeSwitchMethods = std::to_array<HomeSwitchMethod>({
    {3, Edge::kLow, kDown, kUp, false},
    {4, Edge::kLow, kUp, kUp, false},
    {5, Edge::kHigh, kUp, kDown, false},
    {6, Edge::kHigh, kDown, kDown, false},
    {7, Edge::kLow, kDown, kUp, true},
    {8, Edge::kLow, kUp, kUp, true},
    {9, Edge::kHigh, kDown, kUp, true},
    {10, Edge::kHigh, kUp, kUp, true},
    {11, Edge::kHigh, kUp, kDown, true},
    {12, Edge::kHigh, kDown, kDown, true},
    {13, Edge::kLow, kUp, kDown, true},
    {14, Edge::kLow, kDown, kDown, true},
});

double next_index(double place, double direction, double pitch) {
  const double steps = place / pitch;
  return pitch * (direction > 0 ? std::floor(steps) + 1 : std::ceil(steps) - 1);
}

/// Adds legs until the home switch is active. False = it is not found.
bool look_for_switch(HomingWay& way, const HomeSwitchMethod& row, double place, const AxisLayout& layout) {
  if (place >= layout.home_low && place <= layout.home_high) return true;
  double direction = row.first_direction;
  const bool ahead = direction > 0 ? place < layout.home_low : place > layout.home_high;
  if (!ahead) {
    way.legs.push_back({direction, direction > 0 ? layout.positive_end() : layout.negative_end()});
    if (!row.turns_at_limit) return false;
    direction = -direction;
  }
  way.legs.push_back({direction, direction > 0 ? layout.home_low : layout.home_high});
  return true;
}

HomingWay way_to_home_switch(const HomeSwitchMethod& row, double place, const AxisLayout& layout) {
  HomingWay way;
  way.home = row.edge == Edge::kLow ? layout.home_low : layout.home_high;
  way.blind = !look_for_switch(way, row, place, layout);
  const bool from_within = (row.edge == Edge::kHigh) == (row.last_direction > 0);
  if (!way.blind && !from_within) way.legs.push_back({-row.last_direction, way.home});
  return way;
}

HomingWay way_to_limit(double direction, double place, double limit) {
  HomingWay way;
  way.home = limit;
  if ((limit - place) * direction > 0) way.legs.push_back({direction, limit});
  return way;
}

bool is_to_hard_stop(std::int8_t method) {
  return (method < 0 && method >= -4) || method == 36;
}

HomingWay way_to_hard_stop(std::int8_t method, double place, const AxisLayout& layout, double pitch) {
  const bool positive = method == -1 || method == -3;
  const double stop =
      positive ? layout.positive_end() + layout.stops_beyond : layout.negative_end() - layout.stops_beyond;
  HomingWay way = way_to_limit(positive ? kUp : kDown, place, stop);
  way.hard = true;
  if (method == -1 || method == -2) way.home = next_index(stop, positive ? kDown : kUp, pitch);
  return way;
}

}  // namespace

bool is_homing_method(std::int8_t method) {
  return method == kNoHoming || is_to_hard_stop(method) || (method >= 1 && method <= 14) ||
         (method >= 17 && method <= 30) || method == 33 || method == 34 || method == 35 || method == 37;
}

HomingWay homing_way(std::int8_t method, double place, const AxisLayout& layout, double pitch) {
  if (is_to_hard_stop(method)) return way_to_hard_stop(method, place, layout, pitch);
  HomingWay way;
  way.home = place;
  if (method == 33 || method == 34) way.home = next_index(place, method == 33 ? kDown : kUp, pitch);
  if (method > 30) return way;
  const bool without_index = method > kWithoutIndex;
  const auto base = static_cast<std::int8_t>(without_index ? method - kWithoutIndex : method);
  double last_direction = base == 1 ? kUp : kDown;
  if (base <= 2) {
    way = way_to_limit(-last_direction, place, base == 1 ? layout.negative_end() : layout.positive_end());
  } else {
    const HomeSwitchMethod& row = *std::ranges::find(kHomeSwitchMethods, base, &HomeSwitchMethod::method);
    way = way_to_home_switch(row, place, layout);
    last_direction = row.last_direction;
  }
  if (!without_index) way.home = next_index(way.home, last_direction, pitch);
  return way;
}

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

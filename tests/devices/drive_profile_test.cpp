// SPDX-License-Identifier: MIT
// The profile in closed form: values calculated by hand, and properties that hold for every profile.
#include <rapidcheck.h>

#include "devices/drive/profile.hpp"
#include "sim/number.hpp"
#include "support/catch.hpp"

namespace cbcan::test {

using devices::Dynamics;
using devices::Motion;
using devices::Profile;

namespace {

constexpr Time kStart = 5'000'000;

void check_at(const Profile& profile, Time after, double position, double velocity) {
  INFO(after);
  const Motion motion = profile.at(kStart + after);
  CHECK(motion.position == Approx(position).margin(1e-6));
  CHECK(motion.velocity == Approx(velocity).margin(1e-6));
}

}  // namespace

TEST_CASE("A trapezoid: speeds up, runs, slows down") {
  // 100/s at 100/s^2 up and 50/s^2 down: 1 s and 50, 2 s and 100; the remaining 350 of 500 take 3.5 s.
  const Profile profile = Profile::to_position({0, 0}, 500, {100, 100, 50}, kStart);
  check_at(profile, 0, 0, 0);
  check_at(profile, 500'000, 12.5, 50);
  check_at(profile, 1'000'000, 50, 100);
  check_at(profile, 3'000'000, 250, 100);
  check_at(profile, 5'500'000, 475, 50);
  CHECK(profile.end() == kStart + 6'500'000);
  CHECK(profile.at(profile.end()).position == 500);
  CHECK(profile.at(profile.end()).velocity == 0);
  CHECK(profile.next_change(kStart) == kStart + 1'000'000);
  CHECK(profile.next_change(kStart + 1'000'000) == kStart + 4'500'000);
  CHECK(profile.next_change(profile.end()) == kNever);
}

TEST_CASE("A way too short for full speed is a triangle") {
  const Profile profile = Profile::to_position({10, 0}, -90, {1000, 100, 100}, kStart);
  check_at(profile, 500'000, -2.5, -50);
  check_at(profile, 1'000'000, -40, -100);
  CHECK(profile.end() == kStart + 2'000'000);
}

TEST_CASE("A target behind a moving axis: it stops, reverses and comes back") {
  // Stopping from 100/s takes 1 s and 50; then 50 back: a triangle of 2 * sqrt(0.5) s.
  const Profile profile = Profile::to_position({0, 100}, 0, {1000, 100, 100}, kStart);
  check_at(profile, 1'000'000, 50, 0);
  check_at(profile, 1'000'000 + 707'107, 25, -70.7107);
  CHECK(profile.end() == kStart + 2'414'214);
  CHECK(profile.at(profile.end()).position == 0);
}

TEST_CASE("Faster than allowed: it slows down to the velocity allowed first") {
  const Profile profile = Profile::to_position({0, 200}, 1000, {100, 100, 100}, kStart);
  check_at(profile, 1'000'000, 150, 100);
  check_at(profile, 9'000'000, 950, 100);
  CHECK(profile.end() == kStart + 10'000'000);
}

TEST_CASE("A ramp through standstill uses the deceleration, then the acceleration") {
  const Profile profile = Profile::to_velocity({0, 100}, -100, 50, 100, kStart);
  check_at(profile, 500'000, 37.5, 50);
  check_at(profile, 1'000'000, 50, 0);
  check_at(profile, 3'000'000, -50, -100);
  check_at(profile, 4'000'000, -150, -100);
  CHECK(profile.end() == kStart + 3'000'000);
  CHECK(profile.steady_since(kStart + 2'000'000) == kNever);
  CHECK(profile.steady_since(kStart + 9'000'000) == kStart + 3'000'000);
}

TEST_CASE("When a position is reached") {
  const Profile profile = Profile::to_velocity({0, 100}, -100, 100, 100, kStart);
  CHECK(profile.time_at(37.5, kStart) == kStart + 500'000);
  CHECK(profile.time_at(37.5, kStart + 500'001) == kStart + 1'500'000);
  CHECK(profile.time_at(-100, kStart) == kStart + 3'000'000);
  CHECK(profile.time_at(60, kStart) == kNever);
}

TEST_CASE("A velocity of 0 gets nowhere; an acceleration of 0 is at once") {
  const Profile stays = Profile::to_position({7, 0}, 100, {0, 10, 10}, kStart);
  CHECK(stays.end() == kStart);
  CHECK(stays.at(kStart + kSecond).position == 7);
  const Profile jumps = Profile::to_velocity({0, 0}, 100, 0, 0, kStart);
  CHECK(jumps.end() == kStart);
  check_at(jumps, 1'000'000, 100, 100);
}

TEST_CASE("Straight lines are there on the microsecond") {
  const Profile line = Profile::line(10, 25, 1000, kStart);
  check_at(line, 500, 17.5, 15'000);
  CHECK(line.end() == kStart + 1000);
  CHECK(line.at(kStart + 1000).position == 25);
  CHECK(line.at(kStart + 1000).velocity == 0);
}

TEST_CASE("User units: 80,000 increments are 24.41 mm") {
  // 65,536 increments per revolution, 5 motor revolutions per shaft revolution, a feed of 100 mm.
  const devices::Units units({{65'536, 1}, {5, 1}, {100, 1}});
  CHECK(units.user(80'000) == Approx(24.4140625));
  CHECK(units.increments(24.4140625) == 80'000);
  CHECK(units.increments_per_revolution() == 65'536);
  const devices::Units micrometres({{65'536, 1}, {5, 1}, {100'000, 1}});
  CHECK(sim::rounded<std::int32_t>(micrometres.user(80'000)) == 24'414);
  CHECK(sim::rounded<std::int32_t>(micrometres.increments(24'414)) == 80'000);
  CHECK(devices::Units({{0, 1}, {5, 2}, {1, 0}}).increments(2) == 5);
}

TEST_CASE("User units: what else may say so") {
  static constexpr devices::Ratio kEncoder{3600, 1};
  const auto [name, factors, position, velocity] = GENERATE(table<const char*, devices::UnitFactors, double,
                                                                  double>(
      {{"position factor", {.encoder = kEncoder, .position = {5, 2}}, 2.5, 2.5},
       {"position factor of 1", {.encoder = kEncoder, .position = {1, 1}}, 1, 1},
       {"position factor of 0", {.encoder = kEncoder, .position = {0, 1}}, 3600, 3600},
       {"feed", {.encoder = kEncoder, .feed = {360, 1}, .si_position = 0x00B50000}, 10, 10},
       {"velocity encoder factor", {.encoder = kEncoder, .velocity_encoder = {60, 1}}, 3600, 60},
       {"velocity factor", {.encoder = kEncoder, .feed = {3600, 1}, .velocity = {60, 3600}}, 1, 60},
       {"increments", {.encoder = kEncoder, .si_position = 0x00B50000}, 1, 1},
       {"1/min", {.encoder = kEncoder, .si_position = 0x00B50000, .si_velocity = 0x00B44700}, 1, 60},
       {"1/min, gear", {.encoder = kEncoder, .gear = {2, 1}, .si_velocity = 0x00B44700}, 7200, 120},
       {"mrev/s", {.encoder = kEncoder, .si_position = 0xFDB40000, .si_velocity = 0xFDB40300}, 3.6, 3.6},
       {"0.1 degrees", {.encoder = kEncoder, .si_position = 0xFF410000}, 1, 1},
       {"um, mm/min",
        {.encoder = kEncoder, .feed = {1800, 1}, .si_position = 0xFA010000, .si_velocity = 0xFD014700},
        2,
        2000.0 / 60},
       {"6089h to 608Ch: 0.1 degrees, 1/min",
        {.encoder = kEncoder, .older_position = {-1, 0x41}, .older_velocity = {0, 0xA4}},
        1,
        60},
       {"6089h to 608Ch: um, mm/h",
        {.encoder = kEncoder, .feed = {1800, 1}, .older_position = {-6, 0x01}, .older_velocity = {-3, 0xA8}},
        2,
        2000.0 / 3600},
       {"6089h to 608Ch: increments, 10 increments/s",
        {.encoder = kEncoder, .older_position = {0, 0xAC}, .older_velocity = {1, 0xAC}},
        1,
        10},
       {"6089h to 608Ch: unknown", {.older_position = {0, 0x22}, .older_velocity = {-3, 0}}, 1, 1},
       {"1/min, no resolution", {.si_position = 0x00B50000, .si_velocity = 0x00B44700}, 1, 2000.0 / 60}}));
  INFO(name);
  const devices::Units units(factors);
  CHECK(units.increments(1) == Approx(position));
  CHECK(units.user(position) == Approx(1));
  CHECK(units.increments_per_second(1) == Approx(velocity));
  CHECK(units.user_velocity(velocity) == Approx(1));
}

TEST_CASE("No profile is faster or steeper than it may be, and each ends on its target") {
  const bool held = rc::check([] {
    const Motion from{*rc::gen::inRange(-1'000'000, 1'000'001) * 1.0,
                      *rc::gen::inRange(-200'000, 200'001) * 1.0};
    const double target = *rc::gen::inRange(-1'000'000, 1'000'001);
    const Dynamics dynamics{*rc::gen::inRange(1, 200'000) * 1.0, *rc::gen::inRange(1, 1'000'000) * 1.0,
                            *rc::gen::inRange(1, 1'000'000) * 1.0};
    const Profile profile = Profile::to_position(from, target, dynamics, kStart);
    RC_ASSERT(profile.at(profile.end()).position == target);
    RC_ASSERT(profile.at(profile.end()).velocity == 0);
    const double fastest = std::max(std::abs(from.velocity), dynamics.velocity) + 1e-6;
    const double steepest = std::max(dynamics.acceleration, dynamics.deceleration);
    const Time length = profile.end() - kStart;
    Motion before = profile.at(kStart);
    RC_ASSERT(std::abs(before.position - from.position) < 1e-6);
    constexpr Time kSteps = 200;
    for (Time i = 1; i <= kSteps; ++i) {
      const Motion now = profile.at(kStart + length * i / kSteps);
      const double seconds =
          static_cast<double>(length * i / kSteps - length * (i - 1) / kSteps) * 1e-6 + 1e-6;
      RC_ASSERT(std::abs(now.velocity) <= fastest);
      RC_ASSERT(std::abs(now.velocity - before.velocity) <= steepest * seconds * (1 + 1e-9) + 1e-6);
      RC_ASSERT(std::abs(now.position - before.position) <= fastest * seconds + 1e-3);
      before = now;
    }
  });
  CHECK(held);
}

}  // namespace cbcan::test

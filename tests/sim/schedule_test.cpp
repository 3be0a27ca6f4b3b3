// SPDX-License-Identifier: MIT
#include "sim/schedule.hpp"

#include <algorithm>
#include <random>
#include <vector>

#include "support/catch.hpp"

TEST_CASE("Schedule: the first is the earliest, of several the one with the lowest number") {
  cbcan::sim::Schedule schedule;
  CHECK(schedule.first_time() == cbcan::kNever);
  std::vector<cbcan::Time> times(50, cbcan::kNever);
  for (std::size_t i = 0; i < times.size(); ++i)
    CHECK(schedule.add() == i);
  std::mt19937 random(1);
  for (int step = 0; step < 10'000; ++step) {
    const std::size_t who = random() % times.size();
    times[who] = random() % 4 == 0 ? cbcan::kNever : random() % 100;
    schedule.set(who, times[who]);
    const auto earliest = std::min_element(times.begin(), times.end());
    REQUIRE(schedule.first_time() == *earliest);
    if (*earliest != cbcan::kNever)
      REQUIRE(schedule.first() == static_cast<std::size_t>(earliest - times.begin()));
  }
}

// SPDX-License-Identifier: MIT
#include "sim/schedule.hpp"

#include "support/catch.hpp"

namespace {

/// Records that it is polled, and is due never again.
struct Guest final : cbcan::sim::Timed {
  Guest(cbcan::sim::Schedule& schedule, std::size_t number, std::vector<std::size_t>& polled)
      : Timed(schedule), number_(number), polled_(polled) {}
  void poll(cbcan::Time) override {
    polled_.push_back(number_);
    wants(cbcan::kNever);
  }
  using Timed::wants;

 private:
  std::size_t number_;
  std::vector<std::size_t>& polled_;
};

}  // namespace

TEST_CASE("Schedule: the first is the earliest, of several the one with the lowest number") {
  cbcan::sim::Schedule schedule;
  CHECK(schedule.first_time() == cbcan::kNever);
  std::vector<cbcan::Time> times(50, cbcan::kNever);
  std::vector<std::size_t> polled;
  std::deque<Guest> guests;
  for (std::size_t i = 0; i < times.size(); ++i)
    guests.emplace_back(schedule, i, polled);
  std::mt19937 random(1);
  for (int step = 0; step < 10'000; ++step) {
    const std::size_t who = random() % times.size();
    times[who] = random() % 4 == 0 ? cbcan::kNever : random() % 100;
    guests[who].wants(times[who]);
    const auto earliest = std::min_element(times.begin(), times.end());
    REQUIRE(schedule.first_time() == *earliest);
    if (*earliest == cbcan::kNever || step % 8 != 0) continue;
    std::vector<std::size_t> due;
    for (std::size_t i = 0; i < times.size(); ++i)
      if (times[i] == *earliest) due.push_back(i);
    schedule.poll(*earliest);
    REQUIRE(polled == due);
    for (const std::size_t i : due)
      times[i] = cbcan::kNever;
    polled.clear();
  }
}

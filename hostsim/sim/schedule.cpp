// SPDX-License-Identifier: MIT
#include "sim/schedule.hpp"

#include <algorithm>

namespace cbcan::sim {

std::size_t Schedule::add(Timed& timed) {
  const auto left = std::ranges::find(timed_, nullptr);
  if (left != timed_.end()) {
    *left = &timed;
    return static_cast<std::size_t>(left - timed_.begin());
  }
  const std::size_t number = timed_.size();
  timed_.push_back(&timed);
  slots_.push_back(number);
  heap_.push_back({kNever, number});
  return number;
}

void Schedule::set(std::size_t number, Time time) {
  const std::size_t slot = slots_[number];
  if (time < heap_[slot].time)
    sift_up(slot, {time, number});
  else
    sift_down(slot, {time, number});
}

void Schedule::sift_up(std::size_t slot, const Due& moving) {
  while (slot != 0) {
    const std::size_t parent = (slot - 1) / 2;
    if (!moving.before(heap_[parent])) break;
    place(slot, heap_[parent]);
    slot = parent;
  }
  place(slot, moving);
}

void Schedule::sift_down(std::size_t slot, const Due& moving) {
  for (std::size_t child = 2 * slot + 1; child < heap_.size(); child = 2 * slot + 1) {
    if (child + 1 < heap_.size() && heap_[child + 1].before(heap_[child])) ++child;
    if (!heap_[child].before(moving)) break;
    place(slot, heap_[child]);
    slot = child;
  }
  place(slot, moving);
}

}  // namespace cbcan::sim

// SPDX-License-Identifier: MIT
#include "sim/schedule.hpp"

#include <utility>

namespace cbcan::sim {

std::size_t Schedule::add(Timed& timed) {
  const std::size_t number = times_.size();
  timed_.push_back(&timed);
  times_.push_back(kNever);
  slots_.push_back(number);
  heap_.push_back(number);
  return number;
}

void Schedule::move(std::size_t number, Time time) {
  const Time before_change = std::exchange(times_[number], time);
  time < before_change ? sift_up(slots_[number]) : sift_down(slots_[number]);
}

void Schedule::sift_up(std::size_t slot) {
  const std::size_t moving = heap_[slot];
  while (slot != 0) {
    const std::size_t parent = (slot - 1) / 2;
    if (!before(moving, heap_[parent])) break;
    place(slot, heap_[parent]);
    slot = parent;
  }
  place(slot, moving);
}

void Schedule::sift_down(std::size_t slot) {
  const std::size_t moving = heap_[slot];
  for (std::size_t child = 2 * slot + 1; child < heap_.size(); child = 2 * slot + 1) {
    if (child + 1 < heap_.size() && before(heap_[child + 1], heap_[child])) ++child;
    if (!before(heap_[child], moving)) break;
    place(slot, heap_[child]);
    slot = child;
  }
  place(slot, moving);
}

}  // namespace cbcan::sim

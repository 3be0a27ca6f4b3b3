// SPDX-License-Identifier: MIT
#include "sim/schedule.hpp"

namespace cbcan::sim {

std::size_t Schedule::add() {
  const std::size_t participant = times_.size();
  times_.push_back(kNever);
  slots_.push_back(participant);
  heap_.push_back(participant);
  return participant;
}

void Schedule::set(std::size_t participant, Time time) {
  const Time before_change = times_[participant];
  if (time == before_change) return;
  times_[participant] = time;
  time < before_change ? sift_up(slots_[participant]) : sift_down(slots_[participant]);
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

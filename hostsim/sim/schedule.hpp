// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "cbcan/time.hpp"

namespace cbcan::sim {

/// When each of n participants wants to be called: an indexed heap. set() is O(log n) and nothing at all when
/// the time has not changed; first() is O(1). Participants with the same time come in the order of their
/// numbers.
class Schedule {
 public:
  /// Adds a participant, due never; its number is the count so far.
  std::size_t add();
  void set(std::size_t participant, Time time);

  Time first_time() const { return heap_.empty() ? kNever : times_[heap_.front()]; }
  std::size_t first() const { return heap_.front(); }

 private:
  bool before(std::size_t a, std::size_t b) const {
    return times_[a] != times_[b] ? times_[a] < times_[b] : a < b;
  }
  void place(std::size_t slot, std::size_t participant) {
    heap_[slot] = participant;
    slots_[participant] = slot;
  }
  void sift_up(std::size_t slot);
  void sift_down(std::size_t slot);

  std::vector<Time> times_;         ///< by participant
  std::vector<std::size_t> slots_;  ///< where in the heap each participant is
  std::vector<std::size_t> heap_;   ///< participants
};

}  // namespace cbcan::sim

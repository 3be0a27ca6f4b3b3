// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "cbcan/time.hpp"

namespace cbcan::sim {

class Participant;

/// When each participant wants to be polled: an indexed heap. set() is O(log n) and nothing at all when the
/// time has not changed; first_time() is O(1). Participants with the same time come in the order of their
/// numbers.
class Schedule {
 public:
  /// Adds a participant, due never, which lives as long as there are polls; its number is the count so far.
  std::size_t add(Participant& participant);
  void set(std::size_t number, Time time);

  Time first_time() const { return heap_.empty() ? kNever : times_[heap_.front()]; }

  /// Polls those that are due up to and including `now`, also what they want anew.
  void poll(Time now);

 private:
  bool before(std::size_t a, std::size_t b) const {
    return times_[a] != times_[b] ? times_[a] < times_[b] : a < b;
  }
  void place(std::size_t slot, std::size_t number) {
    heap_[slot] = number;
    slots_[number] = slot;
  }
  void sift_up(std::size_t slot);
  void sift_down(std::size_t slot);

  std::vector<Participant*> participants_;  ///< by their numbers
  std::vector<Time> times_;                 ///< likewise
  std::vector<std::size_t> slots_;          ///< likewise: where in the heap it is
  std::vector<std::size_t> heap_;           ///< numbers
};

}  // namespace cbcan::sim

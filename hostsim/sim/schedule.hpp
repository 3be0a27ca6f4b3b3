// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "cbcan/time.hpp"

namespace cbcan::sim {

class Timed;

/// The earliest of the times that `of` gives for each; kNever = there is none.
template <class All, class Of>
Time earliest(All& all, Of of) {
  Time first = kNever;
  for (auto& each : all)
    first = earlier(first, std::invoke(of, each));
  return first;
}

/// When each of several components is to be polled: an indexed heap. set() is O(log n), first_time() is O(1).
/// Components with the same time are polled in the order of their numbers.
class Schedule {
 public:
  /// Adds a component, due at kNever, or removes it; removing allocates nothing.
  std::size_t add(Timed& timed);
  void remove(std::size_t number) {
    set(number, kNever);
    timed_[number] = nullptr;
  }
  void set(std::size_t number, Time time);

  Time first_time() const { return first_time_; }

  /// Polls the components that are due up to and including `now`, repeatedly if they are due again by then.
  void poll(Time now);

 private:
  struct Due {
    bool before(const Due& other) const {
      return time != other.time ? time < other.time : number < other.number;
    }

    Time time;
    std::size_t number;
  };

  void place(std::size_t slot, const Due& due) {
    heap_[slot] = due;
    slots_[due.number] = slot;
    if (slot == 0) first_time_ = due.time;
  }
  void sift_up(std::size_t slot, const Due& moving);
  void sift_down(std::size_t slot, const Due& moving);

  std::vector<Timed*> timed_;       ///< by number; null = removed
  std::vector<std::size_t> slots_;  ///< by number: where in the heap it is
  std::vector<Due> heap_;
  Time first_time_ = kNever;
};

/// A component that the schedule polls at the time that it asked for last; it asks again after every event.
class Timed {
 public:
  explicit Timed(Schedule& schedule) : schedule_(schedule), number_(schedule.add(*this)) {}
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;

  virtual void poll(Time now) = 0;

 protected:
  ~Timed() { schedule_.remove(number_); }
  void wants(Time next) {
    if (next != wanted_) schedule_.set(number_, wanted_ = next);
  }
  Time wanted() const { return wanted_; }

 private:
  Schedule& schedule_;
  std::size_t number_;
  Time wanted_ = kNever;
};

inline void Schedule::poll(Time now) {
  while (first_time() <= now)
    timed_[heap_.front().number]->poll(now);
}

}  // namespace cbcan::sim

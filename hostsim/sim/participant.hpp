// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "sim/bus.hpp"
#include "sim/schedule.hpp"

namespace cbcan::sim {

/// Somebody at the bus with a sense of time: is polled when it wanted to be, and says after everything that
/// happens to it when that is next.
class Participant : public Receiver {
 public:
  explicit Participant(Schedule& schedule) : schedule_(schedule), number_(schedule.add(*this)) {}
  virtual ~Participant() = default;
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  virtual void start(Time now) = 0;
  virtual void poll(Time now) = 0;

 protected:
  void wants(Time next) { schedule_.set(number_, next); }

 private:
  Schedule& schedule_;
  std::size_t number_;
};

}  // namespace cbcan::sim

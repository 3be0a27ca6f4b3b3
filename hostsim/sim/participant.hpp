// SPDX-License-Identifier: MIT
#pragma once

#include "sim/bus.hpp"
#include "sim/schedule.hpp"

namespace cbcan::sim {

/// A component that is on the bus and is polled by the schedule.
class Participant : public Receiver, public Timed {
 public:
  using Timed::Timed;
  virtual ~Participant() = default;

  virtual void start(Time now) = 0;
};

}  // namespace cbcan::sim

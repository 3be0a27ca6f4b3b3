// SPDX-License-Identifier: MIT
#pragma once

#include "sim/bus.hpp"
#include "sim/schedule.hpp"

namespace cbcan::sim {

/// Somebody at the bus with a sense of time.
class Participant : public Receiver, public Timed {
 public:
  using Timed::Timed;
  virtual ~Participant() = default;

  virtual void start(Time now) = 0;
};

}  // namespace cbcan::sim

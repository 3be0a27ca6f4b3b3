// SPDX-License-Identifier: MIT
#pragma once

/// A connection from a simulated bus to a bus outside this program.

#include "cbcan/time.hpp"
#include "sim/bus.hpp"

namespace cbcan::io {

class OutsideBus : public sim::Outside {
 public:
  virtual ~OutsideBus() = default;

  /// Call it before the bus is advanced: passes on changes of the outside bus's state.
  virtual void poll(Time now) = 0;

  /// When poll() and then the bus's advance() are to be called; kNever = only after the next frame.
  virtual Time next_deadline() const = 0;
};

}  // namespace cbcan::io

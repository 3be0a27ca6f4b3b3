// SPDX-License-Identifier: MIT
#pragma once

/// The wire of a simulated bus that goes on outside this program.

#include "cbcan/time.hpp"
#include "sim/bus.hpp"

namespace cbcan::io {

class OutsideBus : public sim::Outside {
 public:
  virtual ~OutsideBus() = default;

  /// To be called before the bus is advanced: tells the bus what has been found out about the outside.
  virtual void poll(Time now) = 0;

  /// When poll() and then the bus's advance() have something to do; kNever = only after the next frame.
  virtual Time next_deadline() const = 0;
};

}  // namespace cbcan::io

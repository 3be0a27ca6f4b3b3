// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "cbcan/time.hpp"

namespace cbcan::boards {

/// Extends a free-running 32-bit microsecond counter to the core's time. The counter wraps every 71.6
/// minutes: call now() at least that often, and from one context.
class Clock {
 public:
  Time now(std::uint32_t counter) {
    time_ += counter - last_;
    last_ = counter;
    return time_;
  }

 private:
  Time time_ = 0;
  std::uint32_t last_ = 0;
};

}  // namespace cbcan::boards

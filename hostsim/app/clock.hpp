// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "cbcan/time.hpp"
#include "io/loop/output.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::app {

/// The time of the simulation: this machine's clock, or one that moves by commands.
class Clock {
 public:
  Clock(const io::Reactor& reactor, bool runs) : reactor_(reactor), runs_(runs) {}
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;

  /// Constant during a turn; the reference stays valid and shows later changes.
  const Time& now() const { return runs_ ? reactor_.time() : manual_; }
  /// Offset from now() to wall-clock time (microseconds since 1970); 0 = there is none.
  Time wall_offset() const { return runs_ ? io::Reactor::wall_offset() : 0; }
  /// Time passes automatically; else by commands, in steps of any length.
  bool runs() const { return runs_; }
  /// Limit of output that is not read in time, in bytes: on a manual clock hours may pass at once.
  std::size_t most_waiting() const { return runs_ ? io::Output::kMostWaiting : 256 * 1024 * 1024; }
  /// Sets a manual clock.
  void set(Time now) { manual_ = now; }

 private:
  const io::Reactor& reactor_;
  bool runs_;
  Time manual_ = 0;
};

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>

#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::app {

/// What a script has waited for has not come.
class CheckFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Simulator;

/// What time it is in the simulation, and what makes it go on: this machine's clock, or a ManualClock.
class Clock {
 public:
  explicit Clock(io::Reactor& reactor) : Clock(reactor, reactor.time()) {}
  virtual ~Clock() = default;
  /// The same during a turn; who keeps the reference sees it change.
  const Time& now() const { return shown_; }
  /// What makes wall-clock time (microseconds since 1970) of now()'s; 0 where there is none.
  virtual Time wall_offset() const { return io::Reactor::wall_offset(); }
  /// Time passes by itself; else in steps of any length, when it is told to.
  virtual bool runs() const { return true; }
  /// Until the program is to stop.
  virtual void drive(Simulator& simulator);

 protected:
  Clock(io::Reactor& reactor, const Time& shown) : reactor_(reactor), shown_(shown) {}

  io::Reactor& reactor_;

 private:
  const Time& shown_;
};

}  // namespace cbcan::app

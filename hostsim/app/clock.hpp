// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>

#include "cbcan/time.hpp"
#include "io/loop/output.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::app {

/// A script's wait has timed out.
class CheckFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Simulator;

/// The time of the simulation, and what advances it: this machine's clock, or a ManualClock.
class Clock {
 public:
  explicit Clock(io::Reactor& reactor) : Clock(reactor, reactor.time()) {}
  virtual ~Clock() = default;
  /// Constant during a turn; the reference stays valid and shows later changes.
  const Time& now() const { return shown_; }
  /// Offset from now() to wall-clock time (microseconds since 1970); 0 = there is none.
  virtual Time wall_offset() const { return io::Reactor::wall_offset(); }
  /// Time passes automatically; else by commands, in steps of any length.
  virtual bool runs() const { return true; }
  /// Limit of output that is not read in time, in bytes: on a manual clock hours may pass at once.
  std::size_t most_waiting() const { return runs() ? io::Output::kMostWaiting : 256 * 1024 * 1024; }
  /// Lets this time pass in the plant before it returns.
  virtual void pass(Simulator& simulator, Time duration);
  /// Drives the simulator until the program is to stop.
  virtual void drive(Simulator& simulator);

 protected:
  Clock(io::Reactor& reactor, const Time& shown) : reactor_(reactor), shown_(shown) {}

  io::Reactor& reactor_;

 private:
  const Time& shown_;
};

}  // namespace cbcan::app

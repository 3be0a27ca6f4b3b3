// SPDX-License-Identifier: MIT
#pragma once

#include <signal.h>

#include <functional>
#include <utility>

#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"

namespace cbcan::io {

/// While this object exists, SIGINT, SIGTERM and, unless it was ignored (nohup), SIGHUP are events of the
/// reactor, and SIGPIPE and SIGXFSZ are ignored (a failed write has an errno). The destructor restores them.
/// One per process, created by the main thread before other threads. The reactor outlives it.
class StopSignals {
 public:
  explicit StopSignals(Reactor& reactor);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  bool stop_requested() const { return stop_requested_; }

  /// Lets signals call `on_signal` from now on, in place of requesting a stop.
  void pass_on(std::function<void(int number)> on_signal) { on_signal_ = std::move(on_signal); }
  /// Restores the former handling; for a forked process that becomes another program.
  void restore() const;
  /// Reads signals without a turn of the reactor, for long work between turns; returns stop_requested().
  bool poll();

 private:
  Reactor& reactor_;
  sigset_t former_mask_{};
  struct sigaction former_[2]{};  ///< of the ignored signals
  Descriptor signals_;
  std::function<void(int number)> on_signal_;
  bool stop_requested_ = false;
};

}  // namespace cbcan::io

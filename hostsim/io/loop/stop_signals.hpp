// SPDX-License-Identifier: MIT
#pragma once

#include <signal.h>

#include <functional>
#include <utility>

#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::io {

/// SIGINT, SIGTERM and, unless it was ignored (nohup), SIGHUP as an event of the reactor, and SIGPIPE and
/// SIGXFSZ ignored (what writes is told by its errno), while this object lives: then as they were before. One
/// per process, made by its main thread before there are others. The reactor outlives it.
class StopSignals {
 public:
  explicit StopSignals(Reactor& reactor);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  bool stop_requested() const { return stop_requested_; }

  /// From now on they are no request to stop, but told to `on_signal`.
  void pass_on(std::function<void(int number)> on_signal) { on_signal_ = std::move(on_signal); }
  /// As they were before; for a process that has forked and becomes another program.
  void restore() const;
  /// The same, without a turn of the reactor: for long work between two.
  bool poll();

 private:
  Reactor& reactor_;
  sigset_t former_mask_{};
  struct sigaction former_[2]{};  ///< of what is ignored
  Descriptor signals_;
  std::function<void(int number)> on_signal_;
  bool stop_requested_ = false;
};

}  // namespace cbcan::io

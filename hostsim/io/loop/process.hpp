// SPDX-License-Identifier: MIT
#pragma once

/// This process as others see it: its signals, the command that it runs, and the manager that started it.

#include <signal.h>
#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"

namespace cbcan::io {

/// While this object exists, SIGINT, SIGTERM and, unless it was ignored (nohup), SIGHUP request a stop, as
/// events of the reactor, and SIGPIPE and SIGXFSZ are ignored (a failed write has an errno). The destructor restores them.
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
  /// Lets SIGHUP call `on_hangup` from now on, unless the terminal of the process is gone. False: it requests a
  /// stop.
  void on_hangup(std::function<bool()> on_hangup) { on_hangup_ = std::move(on_hangup); }
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
  std::function<bool()> on_hangup_ = [] { return false; };
  bool had_terminal_;
  bool stop_requested_ = false;
};

/// A command that runs as long as this program does. A guard, a process between the two that only waits,
/// passes signals on; when the command or this program has ended (also by a crash or SIGKILL), it kills
/// everything that the command has left, daemons too.
class ChildProcess {
 public:
  /// `command` is a program, searched for in PATH, and its arguments; `environment` has lines NAME=VALUE,
  /// added to this program's own. The command inherits standard input, output and error, and the terminal.
  /// `prepare` is called in the new process before the command. Throws EnvironmentError when no process can
  /// be created.
  ChildProcess(Reactor& reactor, const std::vector<std::string>& command,
               const std::vector<std::string>& environment, const std::function<void()>& prepare);
  /// Kills the command and all its descendants.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Sends a signal to the command and its process group.
  void signal(int number);

  /// The exit code as in a shell: 128 + the signal's number if one ended the command, 127 if there is no such
  /// program, 126 if it cannot be executed; nullopt while it runs.
  std::optional<int> exit_code() const { return exit_code_; }

 private:
  void reap(int options);

  Reactor& reactor_;
  bool in_foreground_;  ///< of the terminal, which the command gets until it ends
  Descriptor line_;     ///< to the guard: a byte for each signal; closed when this program ends
  pid_t guard_ = 0;
  Descriptor ended_;  ///< readable when the guard has ended
  std::optional<int> exit_code_;
};

/// Sends READY=1 to the service manager that started this program and waits for it (systemd, Type=notify; the
/// protocol is in sd_notify(3), "Notes"). Does nothing without NOTIFY_SOCKET in the environment. Does not
/// block.
void tell_ready(const Warn& warn);

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#pragma once

/// A command that runs as long as this program does. A guard, a process between the two that only waits,
/// passes signals on; when the command or this program has ended (also by a crash or SIGKILL), it kills
/// everything that the command has left, daemons too.

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"

namespace cbcan::io {

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

}  // namespace cbcan::io

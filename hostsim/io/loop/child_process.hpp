// SPDX-License-Identifier: MIT
#pragma once

/// A command that runs as long as this program does. Between the two stands a guard, a process that only
/// waits: it passes signals on, and when the command has ended, or this program has (a crash and SIGKILL
/// too), it kills whatever the command has left behind, daemons too.

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/loop/descriptor.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::io {

class ChildProcess {
 public:
  /// `command` is a program, looked for in PATH, and its arguments; `environment` are lines NAME=VALUE,
  /// besides this program's own. It has this program's standard input, output and error, and its terminal.
  /// `prepare` is called in the new process before the command. Throws EnvironmentError when there can be no
  /// process more.
  ChildProcess(Reactor& reactor, const std::vector<std::string>& command,
               const std::vector<std::string>& environment, const std::function<void()>& prepare);
  /// Kills what runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Passes a signal on to the command and those in its process group.
  void signal(int number);

  /// As a shell has it: 128 and the signal's number where one ended the command, 127 where there is no such
  /// program, 126 where it cannot be executed; nullopt while it runs.
  std::optional<int> exit_code() const { return exit_code_; }

 private:
  void reap(int options);

  Reactor& reactor_;
  bool in_foreground_;  ///< of the terminal, which the command gets and gives back
  Descriptor line_;     ///< to the guard: a byte for each signal; its end is ours
  pid_t guard_ = 0;
  Descriptor ended_;  ///< readable when the guard has
  std::optional<int> exit_code_;
};

}  // namespace cbcan::io

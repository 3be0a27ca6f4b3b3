// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "app/waits.hpp"
#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/sockets/command_session.hpp"

namespace cbcan::app {

/// What a script has waited for has not come.
class CheckFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a clock drives.
class Program {
 public:
  virtual bool stop_requested() const = 0;
  /// The same in the middle of long work: asks for signals.
  virtual bool stopped_meanwhile() = 0;
  /// Does what is due, waits until `until` at most, and takes in what has come; returns how many had
  /// something.
  virtual std::size_t poll(Time until) = 0;
  /// Does what is due.
  virtual void advance() = 0;
  /// Sends what has come of it.
  virtual void flush() = 0;
  /// When the world has something to do next.
  virtual Time next_event() const = 0;
  /// A command of docs/reference/commands.md; what it brings about has happened when it returns the response,
  /// or when the response is there later, see adapters::Dialogue.
  virtual std::string execute(std::string_view line, const std::shared_ptr<adapters::Dialogue>& dialogue) = 0;
  virtual Waits& waits() = 0;
  /// Answers those that are over now; true if there was one.
  virtual bool poll_waits() = 0;

 protected:
  ~Program() = default;
};

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
  virtual void drive(Program& program) {
    while (!program.stop_requested())
      program.poll(kNever);
  }

 protected:
  Clock(io::Reactor& reactor, const Time& shown) : reactor_(reactor), shown_(shown) {}

  io::Reactor& reactor_;

 private:
  const Time& shown_;
};

}  // namespace cbcan::app

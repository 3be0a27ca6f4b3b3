// SPDX-License-Identifier: MIT
#pragma once

/// What time it is in the simulation, and what makes it go on: this machine's clock, or whoever writes to
/// standard input (manual_clock.hpp).

#include <cstddef>
#include <string>
#include <string_view>

#include "cbcan/time.hpp"

namespace cbcan::app {

/// What a clock drives.
class Program {
 public:
  virtual bool stop_requested() const = 0;
  /// Does what is due, waits until `until` at most, and takes in what has come; returns how many had
  /// something.
  virtual std::size_t turn(Time until) = 0;
  /// Does what is due, and sends what has come of it.
  virtual void catch_up() = 0;
  /// A command of docs/control.md; what it brings about has happened when it returns the answer.
  virtual std::string execute(std::string_view line) = 0;

 protected:
  ~Program() = default;
};

class Clock {
 public:
  virtual ~Clock() = default;

  virtual Time now() const = 0;
  /// What makes wall-clock time (microseconds since 1970) of now()'s; 0 where there is none.
  virtual Time wall_offset() const = 0;
  /// Time passes by itself; else in steps of any length, when it is told to.
  virtual bool runs() const = 0;
  /// Until the program is to stop.
  virtual void drive(Program& program) = 0;
};

/// This machine's.
class RealClock final : public Clock {
 public:
  Time now() const override;
  Time wall_offset() const override;
  bool runs() const override { return true; }
  void drive(Program& program) override;
};

/// "12.345678": seconds.
std::string seconds_text(Time time);

}  // namespace cbcan::app

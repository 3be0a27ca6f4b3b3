// SPDX-License-Identifier: MIT
#pragma once

#include "app/clock.hpp"
#include "app/console.hpp"
#include "io/loop/line_input.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::app {

/// Time passes only by the commands pass and wait, on standard input and from all other sources. The end of
/// the input ends the program; a wrong line throws io::UsageError, and a wait that times out CheckFailed.
class ManualClock final : public Clock {
 public:
  /// `reads_input` = false, or a background job of a terminal: standard input is not for commands, and its
  /// end does not end the program.
  ManualClock(io::Reactor& reactor, Console& console, bool reads_input)
      : Clock(reactor, now_), console_(console), reads_input_(reads_input) {}

  Time wall_offset() const override { return 0; }
  bool runs() const override { return false; }
  void pass(Simulator& simulator, Time duration) override;
  void drive(Simulator& simulator) override;

 private:
  void let_time_pass(Simulator& simulator);
  void take_lines(io::LineInput& input, Simulator& simulator);

  Console& console_;
  bool reads_input_;
  Time now_ = 0;
};

}  // namespace cbcan::app

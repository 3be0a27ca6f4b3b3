// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "app/clock.hpp"
#include "app/console.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::app {

/// Time stands still and passes by lines on standard input, `pass 100ms`; commands may stand between them.
/// Ends the program with the input; throws io::UsageError for a line that means nothing: whoever wrote it is
/// a script.
class ManualClock final : public Clock {
 public:
  ManualClock(io::Reactor& reactor, Console& console) : reactor_(reactor), console_(console) {}

  Time now() const override { return now_; }
  Time wall_offset() const override { return 0; }
  bool runs() const override { return false; }
  void drive(Program& program) override;

 private:
  bool pass(Time duration, Program& program);
  void take_line(const std::string& line, Program& program);

  io::Reactor& reactor_;
  Console& console_;
  Time now_ = 0;
};

/// "pass 100ms": a whole number, and us, ms or s; 0 is allowed, a year the most. Throws io::UsageError.
Time parse_pass(std::string_view line);

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "adapters/dialogue.hpp"
#include "app/clock.hpp"
#include "app/console.hpp"
#include "io/loop/line_input.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::app {

/// Time stands still and passes by the commands pass and wait, on standard input and from wherever else. Ends
/// the program with the input; throws io::UsageError for a line that means nothing, and CheckFailed for a
/// wait that was in vain: whoever wrote it is a script.
class ManualClock final : public Clock {
 public:
  /// `reads_input`: else standard input belongs to somebody else, who says when the program ends.
  ManualClock(io::Reactor& reactor, Console& console, bool reads_input)
      : Clock(reactor, now_), console_(console), reads_input_(reads_input) {}

  Time wall_offset() const override { return 0; }
  bool runs() const override { return false; }
  void drive(Simulator& simulator) override;

 private:
  void let_time_pass(Simulator& simulator);
  void take_lines(io::LineInput& input, Simulator& simulator);
  void say(std::string response);

  Console& console_;
  bool reads_input_;
  std::shared_ptr<adapters::Dialogue> dialogue_ = std::make_shared<adapters::Dialogue>();
  Time now_ = 0;
};

}  // namespace cbcan::app

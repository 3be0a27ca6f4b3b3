// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "plant/condition.hpp"

namespace cbcan::plant {

/// The plant, real or virtual, that a scenario is played on.
class Bench {
 public:
  virtual ~Bench() = default;
  virtual View& view() = 0;
  /// Throws Refused for an invalid or unsupported command, as far as this shows without executing it.
  virtual void check(std::string_view line) = 0;
  /// A command of docs/reference/commands.md; its effects have happened when it returns the response. wait
  /// and pass let time pass.
  virtual std::string execute(std::string_view line) = 0;
  /// Lets time pass to the next event, at most to `until`, since the plant's start.
  virtual void advance(Time until) = 0;
  /// The last messages of nodes and faults, lines with the time.
  virtual std::vector<std::string> said() const { return {}; }
};

}  // namespace cbcan::plant

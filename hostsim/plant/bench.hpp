// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "plant/condition.hpp"
#include "plant/wait.hpp"

namespace cbcan::plant {

/// What a scenario is played on.
class Bench {
 public:
  virtual ~Bench() = default;
  virtual View& view() = 0;
  /// Throws Refused for a command that means nothing here, as far as that can be told without executing it.
  virtual void check(std::string_view line) = 0;
  /// A command of docs/reference/commands.md; what it brings about has happened when it returns the response.
  /// wait and pass let time pass.
  virtual std::string execute(std::string_view line) = 0;
  /// Lets time pass to when something happens next, or only to `until`, both since the plant's start.
  virtual void advance(Time until) = 0;
  virtual void add(Listener& listener) = 0;
  virtual void remove(Listener& listener) = 0;
  /// What nodes and faults have said last, lines with the time.
  virtual std::vector<std::string> said() const { return {}; }
};

}  // namespace cbcan::plant

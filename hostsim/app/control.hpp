// SPDX-License-Identifier: MIT
#pragma once

/// Commands at run time, one line each, from a socket (--control) or, on a manual clock, from standard input:
/// what the world does to the plant, and what one may want to know of it. docs/control.md is the page about
/// them. The last line of every response is "ok", with a value where there is one, or "error: " and what is
/// wrong.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cbcan/time.hpp"
#include "sim/world.hpp"

namespace cbcan::app {

/// A command, as `help` and docs/control.md show it.
struct CommandText {
  std::string_view usage;    ///< "set NODE INDEX[:SUB] NUMBER"
  std::string_view meaning;  ///< "An input gets this value from outside"
  std::string_view more;     ///< what only the page adds: sentences
};
std::vector<CommandText> command_texts();

class Control {
 public:
  /// `networks`: all, in order, at least one; they outlive it. `started`: when they were.
  Control(std::vector<sim::World*> networks, Time started)
      : networks_(std::move(networks)), started_(started) {}

  /// Does what the line says, at this time, and returns the response: lines with their ends. What follows on
  /// the bus has not happened yet: advance the worlds before anybody sees the response.
  std::string execute(std::string_view line, Time now);

 private:
  std::vector<sim::World*> networks_;
  Time started_;
};

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

/// A cbcan-sim process with a manual clock, and programs with function blocks that use it. Nothing here waits
/// for real time: a program's cycle waits for the response to its request, and the simulator's time advances
/// on command.

#include <poll.h>

#include <string>
#include <vector>

#include "cbcan/cia405.hpp"
#include "contract/remote/child.hpp"

namespace cbcan::cia405::test {

inline constexpr Time kMs = 1000;
inline constexpr Time kSecond = 1'000'000;

struct Plant {
  /// With node 5, the demo plant's generic node. `port` 0 = any free port.
  explicit Plant(int port = 0);
  ~Plant();

  int port() const { return port_; }
  Time now() const { return now_; }
  void pass(Time time);
  /// The frames on the bus so far that begin with `begin`, as candump writes them: "605#4000200100000000".
  std::vector<std::string> frames(const std::string& begin);

 private:
  std::string log_;
  contract::Child simulator_;
  int port_;
  Time now_ = 0;
};

/// One program: a link, and its blocks.
struct Program {
  explicit Program(int port);

  Link link;
  std::vector<FunctionBlock*> blocks;

  /// Waits for the response to the request in progress, if any; then runs a cycle of the program.
  void cycle(Time now);
};

/// Waits for what the link waits for, at most a minute.
void wait_for(const Link& link);

}  // namespace cbcan::cia405::test

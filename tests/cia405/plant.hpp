// SPDX-License-Identifier: MIT
#pragma once

/// A cbcan-sim process on a manual clock, and programs with function blocks that talk to it. Nothing here
/// waits for time: a program's cycle waits for the answer to its request, and the simulator's time passes
/// when told to.

#include <poll.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cbcan/cia405.hpp"
#include "contract/remote/child.hpp"

namespace cbcan::cia405::test {

inline constexpr Time kMs = 1000;
inline constexpr Time kSecond = 1'000'000;

class Plant {
 public:
  /// With node 5, the demo plant's generic node, and what else `options` say. `port` 0 = any free one.
  explicit Plant(const std::vector<std::string>& options = {}, int port = 0);
  ~Plant();

  int port() const { return port_; }
  Time now() const { return now_; }
  void pass(Time time);
  /// A line of docs/control.md; returns the answer.
  std::string command(const std::string& line);
  /// The bus until now, as candump writes frames: "605#4000200100000000".
  std::vector<std::string> frames();
  /// Those frames that begin so.
  std::vector<std::string> frames(const std::string& begin);

 private:
  std::string log_;
  contract::Child simulator_;
  int port_;
  Time now_ = 0;
};

/// One program: a link, and its blocks.
class Program {
 public:
  explicit Program(int port, std::optional<Sharing> sharing = {});

  Link link;
  std::vector<FunctionBlock*> blocks;

  /// Waits until the answer of the request under way is there, if there is one; then a cycle of the program.
  void cycle(Time now);
};

/// A plant with one program, whose cycle takes a millisecond.
class Rig {
 public:
  explicit Rig(const std::vector<std::string>& options = {}) : plant(options), program(plant.port()) {}

  Plant plant;
  Program program;

  /// A cycle; then `time` passes.
  void cycle(Time time = kMs);
  void cycles(int count);
  /// Cycles until the condition holds; false if that takes more than a million.
  bool until(const std::function<bool()>& condition, Time time = kMs);

  /// One whole execution: false, true until it has ended. The block stays enabled.
  template <typename Block>
  Block& run(Block& block) {
    block.enable = false;
    block.call(plant.now());
    block.enable = true;
    block.call(plant.now());
    program.blocks = {&block};
    until([&] { return block.confirm || block.error != KernelError::kNone; });
    return block;
  }
  /// The same with inputs set.
  template <typename Block>
  std::unique_ptr<Block> run(const std::function<void(Block&)>& set) {
    auto block = std::make_unique<Block>(program.link);
    set(*block);
    run(*block);
    program.blocks.clear();
    return block;
  }
};

/// Waits for what the link waits for, at most a minute.
void wait_for(const Link& link);

}  // namespace cbcan::cia405::test

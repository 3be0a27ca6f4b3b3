// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>

namespace cbcan::devices {

/// What a call of a script has cost, in bytes that Lua has read or may have read. 16 bytes are a step; limits
/// are in steps. An instruction costs one step, and further ones for the data that it may read.
class CostModel {
 public:
  using Bytes = std::size_t;
  static constexpr Bytes kStep = 16;
  static constexpr Bytes kCall = 8;      ///< of a function of Lua's library; each argument costs 1 more
  static constexpr Bytes kNumber = 160;  ///< converting a number to a string
  static constexpr Bytes kError =
      16'000;  ///< to name the faulty value, Lua searches all instructions before it

  // What one instruction may read.
  Bytes longest_string = 0;    ///< of all so far
  Bytes largest_function = 0;  ///< the same
  std::size_t metatables = 0;  ///< each access to a table may follow a chain of them
  bool has_remainder = false;  ///< the script uses the operator %

  void begin_call() { spent_ = 0; }
  void spend(Bytes bytes) { spent_ += bytes; }
  /// Steps of the call so far.
  std::size_t steps() const { return spent_ / kStep; }

  /// Call it when any of these has changed. `memory`: of the script, in bytes.
  void update(Bytes memory) {
    const std::size_t shared = largest_function / sizeof(void*);  // variables
    steps_ = static_cast<int>(longest_string / kStringBytes + memory / kMemoryBytes +
                              metatables / kMetatables + shared * shared / kSharedSquare) +
             (has_remainder ? kRemainder : 1);
  }
  /// Instructions between two updates.
  int interval() const { return std::max(1, kIntervalSteps / steps_); }
  Bytes of_interval() const { return static_cast<Bytes>(interval() * steps_) * kStep; }

 private:
  // Amounts of data that make an instruction cost one step more.
  static constexpr Bytes kStringBytes = 200;
  static constexpr Bytes kMemoryBytes = 6000;
  static constexpr std::size_t kMetatables = 4;
  /// Cost of Lua's walk along the list of all shared variables, for each one of a new function.
  static constexpr std::size_t kSharedSquare = 500;
  /// Steps of each instruction: the remainder of two floats takes a round for each bit between their
  /// exponents.
  static constexpr int kRemainder = 16;
  static constexpr int kIntervalSteps = 1000;

  int steps_ = 1;  ///< of an instruction
  Bytes spent_ = 0;
};

}  // namespace cbcan::devices

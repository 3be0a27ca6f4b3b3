// SPDX-License-Identifier: MIT
#pragma once

/// Blocks of process models, for wires and scripts. The input of a block is constant from one put() to the
/// next, and the output then exact, however often and at which times it is read. Time never goes back.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "cbcan/time.hpp"

namespace cbcan::sim {

class Block {
 public:
  enum class Kind : std::uint8_t { kPt1, kIntegrator, kDeadTime, kPid, kRamp, kHysteresis };

  static constexpr double kMost = 1e100;
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  /// Keys of the text; times are in s.
  struct Parameters {
    double time = 1;  ///< time constant, or dead time
    double gain = 1;  ///< of an integrator, per s
    double p = 1, i = 0, d = 0;
    double filter = 0.1;     ///< time constant of the derivative
    double up = 1;           ///< slopes of a ramp, per s
    double down = kNone;     ///< as up
    double on = 1, off = 0;  ///< thresholds
    double low = -kMost, high = kMost;
    double start = kNone;  ///< first output: the first input, or 0
  };

  /// `problem`: what is wrong with the text, such as "ramp: hight: no such key; there are up, down and
  /// start".
  struct Parsed;
  /// "pt1 time=5", "pid p=2 i=0.1 low=0 high=100"
  static Parsed parse(std::string_view text);
  /// Passes its input on; with a time, as a first-order lag or later.
  static Block lag(Time time);
  static Block dead_time(Time time);

  /// The input from now on. The first one counts as if it had always been there.
  void put(double input, Time now);
  /// The output; steps up to now have been taken.
  double at(Time now);

  /// The next time at which the output changes in a step; kNever = none.
  Time next_step() const { return waiting_.empty() ? kNever : waiting_.front().first; }
  /// The output changes continuously until then.
  Time moves_until() const;
  /// The time of the last put().
  Time since() const { return since_; }
  std::size_t waiting() const { return waiting_.size(); }
  /// A step of the input is a step of the output at the same time.
  bool is_immediate() const;

 private:
  /// Output without direct parts, and the filtered input of a PID.
  struct State {
    double output = 0;
    double filtered = 0;
  };

  void begin(double input, Time now);
  void put_later(double input, Time arrives);
  double limited(double value) const;
  State after(Time elapsed) const;
  double shown(const State& state) const;

  Kind kind_ = Kind::kPt1;
  Parameters parameters_{};
  bool begun_ = false;
  double input_ = 0;
  State state_{};  ///< at since_
  Time since_ = 0;
  std::deque<std::pair<Time, double>> waiting_{};  ///< of a dead time: when each value arrives
};

struct Block::Parsed {
  Block block;
  std::string problem{};
};

}  // namespace cbcan::sim

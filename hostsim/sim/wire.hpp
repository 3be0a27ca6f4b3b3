// SPDX-License-Identifier: MIT
#pragma once

/// Wires, how they change the value from their beginning to their end, and the blocks of process models in
/// them and in scripts: pure, and independent of when and how often the output is read.
///
/// The input of a block is constant from one put() to the next, and the output then exact. Time never goes
/// back.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
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

/// A number of a node where a wire can begin or end.
struct Terminal {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::optional<std::uint8_t> bit;  ///< none = the whole number
  bool is_output = false;           ///< the value at the terminals of the output, not the one written
  bool operator==(const Terminal&) const = default;
};

/// The terminals of an I/O module, numbered from 1.
struct Terminals {
  std::string_view name;
  std::uint16_t index;
  unsigned bits;  ///< in each sub-index; 0 = one number
  bool is_output;
};
inline constexpr auto kTerminals = std::to_array<Terminals>({{"output", 0x6200, 8, true},
                                                             {"analogue-output", 0x6411, 0, true},
                                                             {"input", 0x6000, 8, false},
                                                             {"analogue-input", 0x6401, 0, false}});

/// Applied in this order: inversion, scale and offset, limits, delay, then lag or block.
struct TransferFunction {
  bool inverted = false;  ///< 0 becomes 1, anything else 0
  double scale = 1;
  double offset = 0;
  std::optional<double> low;
  std::optional<double> high;
  Time delay = 0;
  Time lag = 0;         ///< the time constant of a first order lag; 0 = none
  std::string block{};  ///< as Block::parse() reads it; empty = none
  bool sum = false;     ///< the target gets the sum of all its wires
  Time sample_period =
      10 * kMillisecond;  ///< above 0: how often a value that changes continuously is passed on
  bool operator==(const TransferFunction&) const = default;
};

class Wire {
 public:
  /// A block has been checked.
  explicit Wire(const TransferFunction& transfer);
  const TransferFunction& transfer() const { return transfer_; }

  /// Sets the value at the beginning. The first value counts as if it had always been there.
  void put(double value, Time now);

  /// The value at the end. Time never goes back.
  double take(Time now);

  /// When the value at the end changes next after `now`, as far as is known; during a lag the next sample.
  Time next_change(Time now) const;

 private:
  double shaped(double value) const;

  TransferFunction transfer_;
  Block delay_;
  Block block_;
  bool begun_ = false;
};

}  // namespace cbcan::sim

// SPDX-License-Identifier: MIT
#pragma once

/// Values over time, for the inputs of simulated devices: what a sensor would measure. A signal is a function
/// without state, so the same signal gives the same values in every run, however often it is evaluated. Sines
/// and normal noise are as exact as the machine's mathematical library.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "cbcan/time.hpp"

namespace cbcan::sim {

struct Constant {
  double value = 0;
  bool operator==(const Constant&) const = default;
};

/// A straight line; then it stays at `to`, begins again at `from`, or goes back and forth. Without a duration it
/// is `to` from the start.
struct Ramp {
  enum class Then : std::uint8_t { kHold, kRepeat, kBackAndForth };
  double from = 0;
  double to = 0;
  Time duration = 0;
  Then then = Then::kHold;
  bool operator==(const Ramp&) const = default;
};

/// mean + amplitude * sin(2 pi t / period + phase). Without a period it is its mean.
struct Sine {
  double mean = 0;
  double amplitude = 0;
  Time period = 0;
  double phase = 0;  ///< degrees
  bool operator==(const Sine&) const = default;
};

/// A new value for each sample, which depends only on the seed and the number of the sample.
struct Noise {
  enum class Distribution : std::uint8_t {
    kUniform,  ///< from mean - deviation up to mean + deviation
    kNormal,   ///< deviation is the standard deviation
  };
  double mean = 0;
  double deviation = 0;
  std::uint64_t seed = 0;
  Distribution distribution = Distribution::kNormal;
  bool operator==(const Noise&) const = default;
};

/// Recorded values. Before the first point the value is that of the first point. With `repeat` the signal begins
/// again at the time of the last point, whose value is used only for interpolation.
struct Replay {
  struct Point {
    Time at = 0;
    double value = 0;
    bool operator==(const Point&) const = default;
  };
  enum class Between : std::uint8_t { kStep, kLinear };
  std::vector<Point> points;  ///< at least one, each later than the one before
  Between between = Between::kStep;
  bool repeat = false;
  bool operator==(const Replay&) const = default;
};

using Shape = std::variant<Constant, Ramp, Sine, Noise, Replay>;

/// A shape at an input, an object of a device, in the unit of Behaviour::set_input().
struct Signal {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  Time sample_period = 10 * kMillisecond;  ///< above 0
  Shape shape;

  /// Times are since the start of the signal.
  double value_at(Time since_start) const;
  /// The first multiple of the sample period after `since_start`; kNever when the value no longer changes.
  Time next_sample(Time since_start) const;
  bool operator==(const Signal&) const = default;
};

/// What a CSV text contains.
struct CsvPoints {
  std::vector<Replay::Point> points;
  std::string problem;   ///< empty = none; else what is wrong and what is allowed
  std::size_t line = 0;  ///< where, from 1
};

/// One point a line, `seconds,value`, with decimal points. Times start at 0 or later, each is later than the one
/// before, in steps of a microsecond. Blank lines, lines that begin with # and a first line of column names are
/// skipped; blanks around numbers, CR LF and a byte order mark are allowed. Stops at the first problem.
CsvPoints parse_csv_points(std::string_view text);

}  // namespace cbcan::sim

// SPDX-License-Identifier: MIT
#pragma once

/// What a wire makes of the value at its one end until it stands at the other: pure, and the same however
/// often and whenever somebody looks.

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>
#include <utility>

#include "cbcan/time.hpp"

namespace cbcan::sim {

/// A number of a node that a wire can begin or end at.
struct Terminal {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::optional<std::uint8_t> bit;  ///< none = the whole number
  bool is_output = false;           ///< what stands at the output's terminals, not what was written
  bool operator==(const Terminal&) const = default;
};

/// The terminals of an I/O module, which are numbered from 1.
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

/// In this order: inverted, scaled, limited, delayed, lagging.
struct TransferFunction {
  bool inverted = false;  ///< 0 becomes 1, anything else 0
  double scale = 1;
  double offset = 0;
  std::optional<double> low;
  std::optional<double> high;
  Time delay = 0;
  Time lag = 0;                            ///< the time constant of a first order lag; 0 = none
  Time sample_period = 10 * kMillisecond;  ///< above 0: how often what flows is looked at, and passed on
  bool operator==(const TransferFunction&) const = default;
};

class Wire {
 public:
  explicit Wire(const TransferFunction& transfer) : transfer_(transfer) {}

  /// From now on this is at the beginning. The first value has been there for ever.
  void put(double value, Time now);

  /// What is at the end now. Times never go back.
  double take(Time now);

  /// When that changes next after `now`, as far as is known; of a lag the next sample.
  Time next_change(Time now) const;

 private:
  double shaped(double value) const;
  double at(Time now) const;

  TransferFunction transfer_;
  bool begun_ = false;
  double last_ = 0;                               ///< that was put, shaped
  std::deque<std::pair<Time, double>> on_way_{};  ///< and when each arrives
  double from_ = 0;                               ///< at since_, and on its way to
  double to_ = 0;
  Time since_ = 0;
};

}  // namespace cbcan::sim

// SPDX-License-Identifier: MIT
#pragma once

/// How a wire changes the value from its beginning to its end: pure, and independent of when and how often it
/// is read.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "cbcan/time.hpp"
#include "sim/block.hpp"

namespace cbcan::sim {

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

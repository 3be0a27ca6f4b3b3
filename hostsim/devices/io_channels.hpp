// SPDX-License-Identifier: MIT
#pragma once

/// The four kinds of channels of an I/O module (CiA 401), each with its objects, which share one sub-index.
/// What the node is told, and when, is IoModule's part.

#include <array>
#include <cstdint>

#include "cbcan/time.hpp"
#include "sim/bound.hpp"

namespace cbcan::devices {

/// An input with its filter on has to stand this long before it is seen.
inline constexpr Time kInputFilterTime = milliseconds(3);

/// The first object of each kind: it decides how many channels there are.
inline constexpr std::uint16_t kReadInput = 0x6000;
inline constexpr std::uint16_t kWriteOutput = 0x6200;
inline constexpr std::uint16_t kReadAnalogueInput = 0x6401;
inline constexpr std::uint16_t kWriteAnalogueOutput = 0x6411;

/// Eight digital inputs: terminals -> filter 6003h -> polarity 6002h -> 6000h.
class DigitalInput {
 public:
  DigitalInput(ObjectDictionary& dictionary, std::uint8_t sub);

  bool exists() const { return value_.exists(); }
  void set_terminals(std::uint8_t levels, Time now);
  std::uint8_t terminals() const { return terminals_; }
  /// Lets through the filter what has stood long enough; when it wants to be called again, or kNever.
  Time filter(Time now);
  /// Brings 6000h up to date. True = a change that 6006h, 6007h or 6008h asks for.
  bool refresh();

 private:
  sim::Bound<std::uint8_t> value_, polarity_, filter_, any_change_, low_to_high_, high_to_low_;
  std::uint8_t terminals_;
  std::uint8_t filtered_;
  std::array<Time, 8> changed_at_{};
};

/// Eight digital outputs: 6200h or the error value 6207h -> polarity 6202h -> filter mask 6208h -> terminals.
class DigitalOutput {
 public:
  DigitalOutput(ObjectDictionary& dictionary, std::uint8_t sub);

  void switch_off() { terminals_ = 0; }
  void refresh(bool failed);
  std::uint8_t terminals() const { return terminals_; }

 private:
  sim::Bound<std::uint8_t> value_, polarity_, error_mode_, error_value_, filter_mask_;
  std::uint8_t terminals_ = 0;
};

/// One analogue input of 16 bits. Limits and deltas are compared with the number that 6401h shows.
class AnalogueInput {
 public:
  AnalogueInput(ObjectDictionary& dictionary, std::uint8_t sub);

  bool exists() const { return value_.exists(); }
  void set_terminal(double value);
  /// Brings 6401h up to date. True = a change that 6421h and its limits and deltas ask for.
  bool refresh();
  /// Deltas count from the present value on.
  void told() { told_ = terminal_; }

 private:
  bool beyond_a_limit() const;
  bool far_enough() const;

  sim::Bound<std::int16_t> value_;
  sim::Bound<std::uint8_t> trigger_;
  sim::Bound<std::int32_t> upper_limit_, lower_limit_;
  sim::Bound<std::uint32_t> delta_, negative_delta_, positive_delta_;
  std::int16_t terminal_;
  std::int16_t told_;
};

/// One analogue output of 16 bits: 6411h, or the error value 6444h where 6443h says so.
class AnalogueOutput {
 public:
  AnalogueOutput(ObjectDictionary& dictionary, std::uint8_t sub);

  void refresh(bool failed);
  std::int16_t terminals() const { return terminal_; }

 private:
  sim::Bound<std::int16_t> value_;
  sim::Bound<std::uint8_t> error_mode_;
  sim::Bound<std::int32_t> error_value_;
  std::int16_t terminal_ = 0;
};

}  // namespace cbcan::devices

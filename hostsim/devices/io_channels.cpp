// SPDX-License-Identifier: MIT
#include "devices/io_module.hpp"

namespace cbcan::devices {

namespace {

// Bits of 6421h.
constexpr std::uint8_t kOnUpperLimit = 0x01;
constexpr std::uint8_t kOnLowerLimit = 0x02;
constexpr std::uint8_t kOnDelta = 0x04;
constexpr std::uint8_t kOnNegativeDelta = 0x08;
constexpr std::uint8_t kOnPositiveDelta = 0x10;
constexpr std::uint8_t kOnLimits = kOnUpperLimit | kOnLowerLimit;
constexpr std::uint8_t kOnDeltas = kOnDelta | kOnNegativeDelta | kOnPositiveDelta;

/// Bit by bit: `chosen` where the mask is 1, else `otherwise`.
constexpr std::uint8_t merge(std::uint8_t mask, std::uint8_t chosen, std::uint8_t otherwise) {
  return static_cast<std::uint8_t>((chosen & mask) | (otherwise & ~mask));
}

}  // namespace

// The last argument is the profile's default (CiA 401), for files without the object.

DigitalInput::DigitalInput(ObjectDictionary& dictionary, std::uint8_t sub)
    : value_(dictionary, kReadInput, sub),
      polarity_(dictionary, 0x6002, sub, 0x00),
      filter_(dictionary, 0x6003, sub, 0x00),
      any_change_(dictionary, 0x6006, sub, 0xFF),
      low_to_high_(dictionary, 0x6007, sub, 0x00),
      high_to_low_(dictionary, 0x6008, sub, 0x00),
      terminals_(value_.get() ^ polarity_.get()),
      filtered_(terminals_) {}

void DigitalInput::set_terminals(std::uint8_t levels, Time now) {
  for (unsigned bit = 0; bit < 8; ++bit)
    if (((levels ^ terminals_) >> bit & 1) != 0) changed_at_[bit] = now;
  terminals_ = levels;
}

Time DigitalInput::filter(Time now) {
  if (terminals_ == filtered_) return kNever;
  Time next = kNever;
  for (unsigned bit = 0; bit < 8; ++bit) {
    const auto mask = static_cast<std::uint8_t>(1u << bit);
    if (((terminals_ ^ filtered_) & mask) == 0) continue;
    const Time through = changed_at_[bit] + ((filter_.get() & mask) != 0 ? kInputFilterTime : 0);
    if (through <= now)
      filtered_ ^= mask;
    else
      next = earlier(next, through);
  }
  return next;
}

bool DigitalInput::refresh() {
  const std::uint8_t before = value_.get();
  const auto after = static_cast<std::uint8_t>(filtered_ ^ polarity_.get());
  if (after == before) return false;
  value_.set(after);
  const int rising = after & ~before;
  const int falling = before & ~after;
  return (((rising | falling) & any_change_.get()) | (rising & low_to_high_.get()) |
          (falling & high_to_low_.get())) != 0;
}

DigitalOutput::DigitalOutput(ObjectDictionary& dictionary, std::uint8_t sub)
    : value_(dictionary, kWriteOutput, sub),
      polarity_(dictionary, 0x6202, sub, 0x00),
      error_mode_(dictionary, 0x6206, sub, 0xFF),
      error_value_(dictionary, 0x6207, sub, 0x00),
      filter_mask_(dictionary, 0x6208, sub, 0xFF) {}

void DigitalOutput::refresh(bool failed) {
  std::uint8_t levels = value_.get();
  if (failed) levels = merge(error_mode_.get(), error_value_.get(), levels);
  levels ^= polarity_.get();
  terminals_ = merge(filter_mask_.get(), levels, terminals_);
}

AnalogueInput::AnalogueInput(ObjectDictionary& dictionary, std::uint8_t sub)
    : value_(dictionary, kReadAnalogueInput, sub),
      trigger_(dictionary, 0x6421, sub, kOnLimits | kOnDelta),
      upper_limit_(dictionary, 0x6424, sub),
      lower_limit_(dictionary, 0x6425, sub),
      delta_(dictionary, 0x6426, sub),
      negative_delta_(dictionary, 0x6427, sub),
      positive_delta_(dictionary, 0x6428, sub),
      terminal_(value_.get()),
      told_(terminal_) {}

bool AnalogueInput::refresh() {
  if (value_.get() == terminal_) return false;
  value_.set(terminal_);
  return (trigger_.get() & (kOnLimits | kOnDeltas)) != 0 && beyond_a_limit() && far_enough();
}

bool AnalogueInput::beyond_a_limit() const {
  const std::uint8_t trigger = trigger_.get();
  return (trigger & kOnLimits) == 0 || ((trigger & kOnUpperLimit) != 0 && terminal_ >= upper_limit_.get()) ||
         ((trigger & kOnLowerLimit) != 0 && terminal_ < lower_limit_.get());
}

bool AnalogueInput::far_enough() const {
  const std::uint8_t trigger = trigger_.get();
  const std::int64_t rise = std::int64_t{terminal_} - told_;
  return (trigger & kOnDeltas) == 0 ||
         ((trigger & kOnDelta) != 0 && (rise < 0 ? -rise : rise) >= delta_.get()) ||
         ((trigger & kOnNegativeDelta) != 0 && -rise >= negative_delta_.get()) ||
         ((trigger & kOnPositiveDelta) != 0 && rise >= positive_delta_.get());
}

AnalogueOutput::AnalogueOutput(ObjectDictionary& dictionary, std::uint8_t sub)
    : value_(dictionary, kWriteAnalogueOutput, sub),
      error_mode_(dictionary, 0x6443, sub, 1),
      error_value_(dictionary, 0x6444, sub) {}

void AnalogueOutput::refresh(bool failed) {
  const bool replaced = failed && error_mode_.get() != 0;
  terminal_ = replaced ? sim::rounded<std::int16_t>(error_value_.get()) : value_.get();
}

}  // namespace cbcan::devices

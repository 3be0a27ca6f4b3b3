// SPDX-License-Identifier: MIT
#include "devices/io_module.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace cbcan::devices {

namespace {

constexpr std::size_t kChannelsPerSource = 32;  ///< of a sub-index of 6422h

/// Write objects of all widths, digital and analogue.
constexpr auto kOutputs = std::to_array<std::uint16_t>(
    {kWriteOutput, 0x6220, 0x6300, 0x6320, 0x6410, kWriteAnalogueOutput, 0x6412, 0x6413, 0x6414});

constexpr auto kModuleIncidents = std::to_array<IncidentKind>(
    {{"output-short-circuit", 0x2320, ErrorRegister::kGeneric | ErrorRegister::kCurrent},
     {"input-voltage-low", 0x3120, ErrorRegister::kGeneric | ErrorRegister::kVoltage}});

/// Eight terminals with their numbers.
sim::Point digital(sim::Point::Kind kind, std::uint16_t index, std::size_t place) {
  const std::size_t first = 8 * place + 1;
  sim::Point point{.kind = kind, .index = index, .sub = sub_of(place)};
  point.name =
      fmt::format("{} {} to {}", kind == sim::Point::Kind::kInput ? "inputs" : "outputs", first, first + 7);
  for (std::size_t number = first; number != first + 8; ++number)
    point.bits.push_back(std::to_string(number));
  return point;
}

sim::Point analogue(sim::Point::Kind kind, std::uint16_t index, std::size_t place) {
  using Limits = std::numeric_limits<std::int16_t>;
  const std::string_view name = kind == sim::Point::Kind::kInput ? "analogue input" : "analogue output";
  return {.kind = kind,
          .index = index,
          .sub = sub_of(place),
          .name = fmt::format("{} {}", name, place + 1),
          .low = Limits::min(),
          .high = Limits::max()};
}

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

IoModule::IoModule(sim::DeviceNode& node)
    : DeviceWithIncidents(node, kModuleIncidents),
      digital_interrupts_(node.dictionary(), 0x6005, 0, 1),
      analogue_interrupts_(node.dictionary(), 0x6423, 0, 0),
      digital_inputs_(channels<DigitalInput>(node.dictionary(), {kReadInput})),
      digital_outputs_(channels<DigitalOutput>(node.dictionary(), {kWriteOutput})),
      analogue_inputs_(channels<AnalogueInput>(node.dictionary(), {kReadAnalogueInput})),
      analogue_outputs_(channels<AnalogueOutput>(node.dictionary(), {kWriteAnalogueOutput})),
      interrupt_sources_(channels<InterruptSource>(node.dictionary(), {0x6422})) {
  if (!analogue_interrupts_.exists())
    analogue_interrupts_.set(1);  // without 6423h no client could enable them
}

std::vector<sim::Point> IoModule::points() const {
  using enum sim::Point::Kind;
  std::vector<sim::Point> points;
  const auto add = [&points](const auto& channels, auto make, sim::Point::Kind kind, std::uint16_t index) {
    for (std::size_t place = 0; place != channels.size(); ++place)
      points.push_back(make(kind, index, place));
  };
  add(digital_inputs_, digital, kInput, kReadInput);
  add(digital_outputs_, digital, kOutput, kWriteOutput);
  add(analogue_inputs_, analogue, kInput, kReadAnalogueInput);
  add(analogue_outputs_, analogue, kOutput, kWriteAnalogueOutput);
  return points;
}

std::optional<double> IoModule::output(std::uint16_t index, std::uint8_t sub) const {
  const std::size_t place = sub - std::size_t{1};  // sub-index 0 wraps and is out of range
  if (index == kWriteOutput && place < digital_outputs_.size()) return digital_outputs_[place].terminals();
  if (index == kWriteAnalogueOutput && place < analogue_outputs_.size())
    return analogue_outputs_[place].terminals();
  return std::nullopt;
}

void IoModule::reset(bool application, Time now) {
  told_ = 0;
  if (!application) return;
  begun_ = true;
  failed_ = false;
  interrupted_ = false;
  for (DigitalOutput& output : digital_outputs_)
    output.switch_off();
  for (auto& input : digital_inputs_) {
    input.filter(now);
    input.refresh();
    input.interrupt = false;
  }
  for (auto& input : analogue_inputs_) {
    input.refresh();
    input.told();
    input.interrupt = false;
  }
}

Time IoModule::update(Time now) {
  Time next = kNever;
  for (auto& input : digital_inputs_) {
    next = earlier(next, input.filter(now));
    if (input.refresh() && digital_interrupts_.get() != 0) input.interrupt = interrupted_ = true;
  }
  for (std::size_t place = 0; place != analogue_inputs_.size(); ++place) {
    AnalogueInput& input = analogue_inputs_[place];
    if (!input.refresh() || analogue_interrupts_.get() == 0) continue;
    input.told();
    input.interrupt = interrupted_ = true;
    note_source(place, now);
  }
  for (auto& output : digital_outputs_)
    output.refresh(failed_);
  for (auto& output : analogue_outputs_)
    output.refresh(failed_);
  tell_terminals(digital_inputs_, kReadInput, now);
  tell_terminals(digital_outputs_, kWriteOutput, now);
  tell_terminals(analogue_outputs_, kWriteAnalogueOutput, now);
  if (present_ != told_) tell_incidents(now);
  if (interrupted_) tell(now);
  return next;
}

void IoModule::note_source(std::size_t channel, Time now) {
  if (interrupt_at_ != now)
    for (auto& source : interrupt_sources_)
      source.set(0);
  interrupt_at_ = now;
  if (channel / kChannelsPerSource >= interrupt_sources_.size()) return;
  auto& source = interrupt_sources_[channel / kChannelsPerSource];
  source.set(source.get() | 1u << channel % kChannelsPerSource);
}

/// Called after all inputs have been updated: a PDO triggered by the first may carry the others too.
void IoModule::tell(Time now) {
  for (std::size_t i = 0; i < digital_inputs_.size(); ++i)
    if (std::exchange(digital_inputs_[i].interrupt, false)) node_.changed(kReadInput, sub_of(i), now);
  for (std::size_t i = 0; i < analogue_inputs_.size(); ++i)
    if (std::exchange(analogue_inputs_[i].interrupt, false))
      node_.changed(kReadAnalogueInput, sub_of(i), now);
  interrupted_ = false;
}

/// Leaves out analogue inputs, which change continuously.
template <class Channel>
void IoModule::tell_terminals(std::vector<Channel>& channels, std::uint16_t index, Time now) {
  if (!begun_) return;
  for (Channel& channel : channels) {
    if (channel.shown == channel.terminals()) continue;
    const std::int32_t before = std::exchange(channel.shown, channel.terminals());
    node_.terminals(index, sub_of(static_cast<std::size_t>(&channel - channels.data())), before,
                    channel.shown, now);
  }
}

void IoModule::on_state(nmt::State state, Time /*now*/) {
  if (state == nmt::State::kStopped) failed_ = true;
  if (state == nmt::State::kOperational) failed_ = false;
}

bool IoModule::is_set_point(std::uint16_t index) const {
  return std::ranges::find(kOutputs, index) != kOutputs.end();
}

bool IoModule::set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) {
  if (index == kReadInput)
    if (DigitalInput* input = find(digital_inputs_, sub)) {
      input->set_terminals(sim::rounded<std::uint8_t>(value), now);
      return true;
    }
  if (index == kReadAnalogueInput)
    if (AnalogueInput* input = find(analogue_inputs_, sub)) {
      input->set_terminal(value);
      return true;
    }
  return false;
}

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

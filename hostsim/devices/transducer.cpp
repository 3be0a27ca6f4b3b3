// SPDX-License-Identifier: MIT
#include "devices/transducer.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace cbcan::devices {

namespace {

// Process values.
constexpr std::uint16_t kReal = 0x6130;
constexpr std::uint16_t kShort = 0x7130;
constexpr std::uint16_t kLong = 0x9130;
constexpr std::array<std::uint16_t, 3> kProcessValues{kReal, kShort, kLong};

using Unit = std::pair<std::uint32_t, std::string_view>;
constexpr std::array kUnits{Unit{0x00010000, "m"},  Unit{0x00040000, "A"}, Unit{0x00210000, "N"},
                            Unit{0x00220000, "Pa"}, Unit{0x00260000, "V"}, Unit{0x002D0000, "°C"},
                            Unit{0x004E0000, "bar"}};

// Bits of 6150h.
constexpr std::uint8_t kNotValid = 0x01;
constexpr std::uint8_t kPositiveOverload = 0x02;
constexpr std::uint8_t kNegativeOverload = 0x04;

constexpr std::size_t kSensorBreak = 0;
constexpr std::array kSensorIncidents{IncidentKind{"sensor-break", 0x5000, ErrorRegister::kGeneric}};

template <class Number>
std::uint8_t overload_of(double value) {
  if (value > double{std::numeric_limits<Number>::max()}) return kPositiveOverload;
  if (value < double{std::numeric_limits<Number>::lowest()}) return kNegativeOverload;
  return 0;
}

/// True = the value has changed.
template <class Number>
bool replace(sim::Bound<Number>& value, Number number) {
  const bool changed = value.exists() && value.get() != number;
  value.set(number);
  return changed;
}

}  // namespace

Transducer::Channel::Channel(ObjectDictionary& dictionary, std::uint8_t sub)
    : real_(dictionary, kReal, sub),
      short_(dictionary, kShort, sub),
      long_(dictionary, kLong, sub),
      unit_(dictionary, 0x6131, sub),
      decimal_digits_(dictionary, 0x6132, sub),
      status_(dictionary, 0x6150, sub),
      input_(long_.exists()    ? long_.get() / scale()
             : short_.exists() ? short_.get() / scale()
                               : static_cast<double>(real_.get())) {}

bool Transducer::Channel::has(std::uint16_t index) const {
  return (index == kReal && real_.exists()) || (index == kShort && short_.exists()) ||
         (index == kLong && long_.exists());
}

/// The overload is that of the narrowest process value present.
void Transducer::Channel::refresh(bool broken) {
  const double value = input_ * scale();
  std::uint8_t status = 0;
  if (long_.exists()) status = overload_of<std::int32_t>(value);
  if (short_.exists()) status = overload_of<std::int16_t>(value);
  status_.set(broken ? kNotValid : status);
  if (broken) return;
  untold_[0] |= replace(real_, static_cast<float>(input_));
  untold_[1] |= replace(short_, sim::rounded<std::int16_t>(value));
  untold_[2] |= replace(long_, sim::rounded<std::int32_t>(value));
}

std::string_view Transducer::Channel::unit() const {
  const auto found = std::ranges::find(kUnits, unit_.get(), &Unit::first);
  const bool is_scaled = !real_.exists() && decimal_digits_.get() != 0;
  return found == kUnits.end() || is_scaled ? "" : found->second;
}

void Transducer::Channel::tell(sim::DeviceNode& node, std::uint8_t sub, Time now) {
  for (std::size_t i = 0; i < untold_.size(); ++i)
    if (std::exchange(untold_[i], false)) node.changed(kProcessValues[i], sub, now);
}

Transducer::Transducer(sim::DeviceNode& node)
    : DeviceWithIncidents(node, kSensorIncidents),
      channels_(channels<Channel>(node.dictionary(), {kReal, kShort, kLong})) {}

void Transducer::reset(bool application, Time /*now*/) {
  told_ = 0;
  if (!application) return;
  for (Channel& channel : channels_) {
    channel.refresh(present(kSensorBreak));
    channel.keep_quiet();
  }
}

Time Transducer::update(Time now) {
  for (Channel& channel : channels_)
    channel.refresh(present(kSensorBreak));
  if (present_ != told_) tell_incidents(now);
  for (std::size_t i = 0; i < channels_.size(); ++i)
    channels_[i].tell(node_, sub_of(i), now);
  return kNever;
}

std::vector<sim::Point> Transducer::points() const {
  std::vector<sim::Point> points;
  for (std::size_t place = 0; place != channels_.size(); ++place)
    for (const std::uint16_t index : {kReal, kLong, kShort})
      if (channels_[place].has(index) && (points.empty() || points.back().sub != sub_of(place)))
        points.push_back({.kind = sim::Point::Kind::kInput,
                          .index = index,
                          .sub = sub_of(place),
                          .name = "process value " + std::to_string(place + 1),
                          .unit = std::string(channels_[place].unit())});
  return points;
}

bool Transducer::set_input(std::uint16_t index, std::uint8_t sub, double value, Time /*now*/) {
  if (sub == 0 || sub > channels_.size() || !channels_[sub - 1u].has(index)) return false;
  channels_[sub - 1u].set_input(value);
  return true;
}

}  // namespace cbcan::devices

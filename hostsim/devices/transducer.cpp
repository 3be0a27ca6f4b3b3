// SPDX-License-Identifier: MIT
#include "devices/transducer.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "devices/channels.hpp"
#include "sim/rounded.hpp"

namespace cbcan::devices {

namespace {

constexpr std::uint16_t kDecimalDigits = 0x6132;
constexpr std::uint16_t kStatus = 0x6150;
constexpr std::uint16_t kProcessValue = 0x9130;

// Bits of 6150h.
constexpr std::uint8_t kNotValid = 0x01;
constexpr std::uint8_t kPositiveOverload = 0x02;
constexpr std::uint8_t kNegativeOverload = 0x04;

constexpr std::size_t kSensorBreak = 0;
constexpr std::array<std::string_view, 1> kIncidents{"sensor-break"};
constexpr std::array<ErrorKind, 1> kIncidentErrors{{{0x5000, ErrorRegister::kGeneric}}};

std::uint8_t overload(double value) {
  if (value > double{std::numeric_limits<std::int32_t>::max()}) return kPositiveOverload;
  if (value < double{std::numeric_limits<std::int32_t>::lowest()}) return kNegativeOverload;
  return 0;
}

}  // namespace

Transducer::Channel::Channel(ObjectDictionary& dictionary, std::uint8_t sub)
    : value_(dictionary, kProcessValue, sub),
      decimal_digits_(dictionary, kDecimalDigits, sub),
      status_(dictionary, kStatus, sub),
      input_(value_.get() / scale()) {}

double Transducer::Channel::scale() const {
  return std::pow(10.0, decimal_digits_.get());
}

bool Transducer::Channel::refresh(bool broken) {
  status_.set(broken ? kNotValid : overload(input_ * scale()));
  if (broken) return false;
  const std::int32_t before = value_.get();
  value_.set(sim::rounded<std::int32_t>(input_ * scale()));
  return value_.get() != before;
}

Transducer::Transducer(sim::DeviceNode& node)
    : node_(node),
      channels_(channels<Channel>(node.dictionary(), kProcessValue)),
      incidents_(kIncidents, kIncidentErrors) {}

void Transducer::reset(bool application, Time /*now*/) {
  incidents_.reset();
  if (!application) return;
  for (Channel& channel : channels_) {
    channel.refresh(incidents_.present(kSensorBreak));
    channel.untold = false;
  }
}

Time Transducer::update(Time now) {
  for (Channel& channel : channels_)
    if (channel.refresh(incidents_.present(kSensorBreak))) channel.untold = true;
  incidents_.update(node_, now);
  for (std::size_t i = 0; i < channels_.size(); ++i)
    if (std::exchange(channels_[i].untold, false)) node_.changed(kProcessValue, sub_of(i), now);
  return kNever;
}

bool Transducer::set_input(std::uint16_t index, std::uint8_t sub, double value, Time /*now*/) {
  Channel* channel = index == kProcessValue ? find(channels_, sub) : nullptr;
  if (channel == nullptr) return false;
  channel->set_input(value);
  return true;
}

std::span<const std::string_view> Transducer::incidents() const {
  return incidents_.names();
}

void Transducer::set_incident(std::string_view incident, bool present, Time /*now*/) {
  incidents_.set(incident, present);
}

}  // namespace cbcan::devices

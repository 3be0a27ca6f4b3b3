// SPDX-License-Identifier: MIT
#include "devices/drive/drive.hpp"

#include <algorithm>

#include "sim/schedule.hpp"

namespace cbcan::devices {

namespace {

bool has_word(const ObjectDictionary& dictionary, std::size_t index) {
  ObjectEntry entry{};
  return dictionary.find(static_cast<std::uint16_t>(index), 0, entry) == AbortCode::kNone &&
         entry.capacity == sizeof(std::uint16_t);
}

}  // namespace

std::size_t axis_count(const ObjectDictionary& dictionary) {
  std::size_t count = 1;
  while (count < kMostAxes && has_word(dictionary, 0x6040 + count * kAxisStride) &&
         has_word(dictionary, 0x6041 + count * kAxisStride))
    ++count;
  return count;
}

std::unique_ptr<sim::Behaviour> make_drive(sim::DeviceNode& node, std::span<const AxisLayout> layouts) {
  const std::size_t count = axis_count(node.dictionary());
  if (count > 1) return std::make_unique<Axes>(node, count, layouts);
  return std::make_unique<Drive>(node, layouts.empty() ? AxisLayout{} : layouts.front());
}

Axes::Axes(sim::DeviceNode& node, std::size_t count, std::span<const AxisLayout> layouts) {
  for (std::size_t i = 0; i < count; ++i) {
    axes_.emplace_back(node, errors_, i, i < layouts.size() ? layouts[i] : AxisLayout{});
    const std::string prefix = i == 0 ? "" : "axis-" + std::to_string(i + 1) + "-";
    for (const IncidentKind& kind : kDriveIncidents) {
      names_.push_back(prefix + std::string(kind.name));
      if (kind.alarm) alarms_.push_back(names_.back());
    }
  }
}

void Axes::AxisNode::error(std::uint16_t code, std::uint8_t register_bits, const sim::EmergencyInfo& info,
                           Time now) {
  ++errors_[code];  // the node reports it once
  sim::EmergencyInfo with_number = info;
  with_number[0] = number_;
  node_.error(code, register_bits, with_number, now);
}

void Axes::AxisNode::error_over(std::uint16_t code, Time now) {
  if (--errors_[code] == 0) node_.error_over(code, now);
}

void Axes::reset(bool application, Time now) {
  if (application) errors_.clear();
  each(&Drive::reset, application, now);
}

Time Axes::update(Time now) {
  return sim::earliest(axes_, [now](One& axis) { return axis.drive.update(now); });
}

AbortCode Axes::check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                      Time now) {
  AbortCode code = AbortCode::kNone;
  for (One& axis : axes_)
    if (code == AbortCode::kNone) code = axis.drive.check(entry, sub, value, now);
  return code;
}

bool Axes::is_set_point(std::uint16_t index) const {
  return std::ranges::any_of(axes_, [index](const One& axis) { return axis.drive.is_set_point(index); });
}

bool Axes::set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) {
  return std::ranges::any_of(axes_, [&](One& axis) { return axis.drive.set_input(index, sub, value, now); });
}

std::optional<double> Axes::output(std::uint16_t index, std::uint8_t sub) const {
  std::optional<double> value;
  for (const One& axis : axes_)
    if (!value) value = axis.drive.output(index, sub);
  return value;
}

std::vector<sim::Point> Axes::points() const {
  std::vector<sim::Point> all;
  for (std::size_t i = 0; i < axes_.size(); ++i)
    for (sim::Point point : axes_[i].drive.points()) {
      point.name = "axis " + std::to_string(i + 1) + " " + point.name;
      all.push_back(std::move(point));
    }
  return all;
}

void Axes::set_incident(std::size_t place, bool present, Time now) {
  axes_[place / kDriveIncidents.size()].drive.set_incident(place % kDriveIncidents.size(), present, now);
}

}  // namespace cbcan::devices

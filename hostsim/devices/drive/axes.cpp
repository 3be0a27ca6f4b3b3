// SPDX-License-Identifier: MIT
// A drive with one or several axes.
#include <algorithm>
#include <deque>
#include <map>

#include "devices/drive/drive.hpp"
#include "sim/schedule.hpp"

namespace cbcan::devices {

namespace {

bool has_word(const ObjectDictionary& dictionary, std::size_t index) {
  ObjectEntry entry{};
  return dictionary.find(static_cast<std::uint16_t>(index), 0, entry) == AbortCode::kNone &&
         entry.capacity == sizeof(std::uint16_t);
}

using ErrorCounts = std::map<std::uint16_t, int>;  ///< axes that have an error, by its code

/// The node as one axis sees it.
class AxisNode final : public sim::DeviceNode {
 public:
  AxisNode(sim::DeviceNode& node, ErrorCounts& errors, std::uint8_t number)
      : node_(node), errors_(errors), number_(number) {}

  ObjectDictionary& dictionary() override { return node_.dictionary(); }
  void error(std::uint16_t code, std::uint8_t register_bits, const sim::EmergencyInfo& info,
             Time now) override {
    ++errors_[code];  // the node reports it once
    sim::EmergencyInfo with_number = info;
    with_number[0] = number_;
    node_.error(code, register_bits, with_number, now);
  }
  void error_over(std::uint16_t code, Time now) override {
    if (--errors_[code] == 0) node_.error_over(code, now);
  }
  void changed(std::uint16_t index, std::uint8_t sub, Time now) override { node_.changed(index, sub, now); }

 private:
  sim::DeviceNode& node_;
  ErrorCounts& errors_;
  std::uint8_t number_;
};

/// A drive with several axes. Axis n, from 1 on, is a Drive whose objects are 800h * (n - 1) after
/// those of the first (CiA 301, logical devices), so 6840h is the controlword of the second.
///
/// Incidents of the second axis are called "axis-2-overcurrent". The first manufacturer-specific byte of an
/// EMCY is the number of the axis. A code that two axes have ends when the last of them no longer has it.
class Axes final : public sim::Behaviour {
 public:
  Axes(sim::DeviceNode& node, std::size_t count, std::span<const AxisLayout> layouts) {
    for (std::size_t i = 0; i < count; ++i) {
      axes_.emplace_back(node, errors_, i, i < layouts.size() ? layouts[i] : AxisLayout{});
      const std::string prefix = i == 0 ? "" : "axis-" + std::to_string(i + 1) + "-";
      for (const IncidentKind& kind : kDriveIncidents) {
        names_.push_back(prefix + std::string(kind.name));
        if (kind.alarm) alarms_.push_back(names_.back());
      }
    }
  }

  void reset(bool application, Time now) override {
    if (application) errors_.clear();
    each(&Drive::reset, application, now);
  }
  Time update(Time now) override {
    return sim::earliest(axes_, [now](One& axis) { return axis.drive.update(now); });
  }
  AbortCode check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                  Time now) override {
    AbortCode code = AbortCode::kNone;
    for (One& axis : axes_)
      if (code == AbortCode::kNone) code = axis.drive.check(entry, sub, value, now);
    return code;
  }
  void on_sync(Time now) override { each(&Drive::on_sync, now); }
  void on_state(nmt::State state, Time now) override { each(&Drive::on_state, state, now); }
  void on_network_failure(sim::NetworkFailure failure, Time now) override {
    each(&Drive::on_network_failure, failure, now);
  }
  void delay_commands(Time delay) override { each(&Drive::delay_commands, delay); }
  bool is_set_point(std::uint16_t index) const override {
    return std::ranges::any_of(axes_, [index](const One& axis) { return axis.drive.is_set_point(index); });
  }
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) override {
    return std::ranges::any_of(axes_,
                               [&](One& axis) { return axis.drive.set_input(index, sub, value, now); });
  }
  std::optional<double> output(std::uint16_t index, std::uint8_t sub) const override {
    std::optional<double> value;
    for (const One& axis : axes_)
      if (!value) value = axis.drive.output(index, sub);
    return value;
  }
  std::vector<sim::Point> points() const override {
    std::vector<sim::Point> all;
    for (std::size_t i = 0; i < axes_.size(); ++i)
      for (sim::Point point : axes_[i].drive.points()) {
        point.name = "axis " + std::to_string(i + 1) + " " + point.name;
        all.push_back(std::move(point));
      }
    return all;
  }
  std::vector<std::string_view> incidents() const override { return {names_.begin(), names_.end()}; }
  std::vector<std::string_view> alarms() const override { return {alarms_.begin(), alarms_.end()}; }
  void set_incident(std::size_t place, bool present, Time now) override {
    axes_[place / kDriveIncidents.size()].drive.set_incident(place % kDriveIncidents.size(), present, now);
  }

 private:
  struct One {
    One(sim::DeviceNode& of, ErrorCounts& errors, std::size_t place, const AxisLayout& layout)
        : node(of, errors, static_cast<std::uint8_t>(place + 1)),
          drive(node, layout, static_cast<std::uint16_t>(place * kAxisStride)) {}
    AxisNode node;
    Drive drive;
  };

  template <class... Args>
  void each(void (Drive::*hook)(Args...), Args... args) {
    for (One& axis : axes_)
      (axis.drive.*hook)(args...);
  }

  ErrorCounts errors_;
  std::deque<One> axes_;                     ///< whose items do not move
  std::vector<std::string> names_, alarms_;  ///< of incidents
};

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

}  // namespace cbcan::devices

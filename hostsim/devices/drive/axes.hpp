// SPDX-License-Identifier: MIT
#pragma once

/// A drive with one or several axes. Axis n, from 1 on, is a Drive whose objects are 800h * (n - 1) after
/// those of the first (CiA 301, logical devices), so 6840h is the controlword of the second.
///
/// Incidents of the second axis are called "axis-2-overcurrent". The first manufacturer-specific byte of an
/// EMCY is the number of the axis. A code that two axes have ends when the last of them no longer has it.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "devices/drive/drive.hpp"

namespace cbcan::devices {

/// Those whose controlword and statusword are in the dictionary; at least 1.
std::size_t axis_count(const ObjectDictionary& dictionary);

/// `layouts` of the first axes; the others have the default.
std::unique_ptr<sim::Behaviour> make_drive(sim::DeviceNode& node, std::span<const AxisLayout> layouts);

class Axes final : public sim::Behaviour {
 public:
  Axes(sim::DeviceNode& node, std::size_t count, std::span<const AxisLayout> layouts);

  void reset(bool application, Time now) override;
  Time update(Time now) override;
  AbortCode check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                  Time now) override;
  void on_sync(Time now) override { each(&Drive::on_sync, now); }
  void on_state(nmt::State state, Time now) override { each(&Drive::on_state, state, now); }
  void on_network_failure(sim::NetworkFailure failure, Time now) override {
    each(&Drive::on_network_failure, failure, now);
  }
  void delay_commands(Time delay) override { each(&Drive::delay_commands, delay); }
  bool is_set_point(std::uint16_t index) const override;
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) override;
  std::optional<double> output(std::uint16_t index, std::uint8_t sub) const override;
  std::vector<sim::Point> points() const override;
  std::vector<std::string_view> incidents() const override { return {names_.begin(), names_.end()}; }
  std::vector<std::string_view> alarms() const override { return {alarms_.begin(), alarms_.end()}; }
  void set_incident(std::size_t place, bool present, Time now) override;

 private:
  using ErrorCounts = std::map<std::uint16_t, int>;  ///< axes that have an error, by its code

  /// The node as one axis sees it.
  class AxisNode final : public sim::DeviceNode {
   public:
    AxisNode(sim::DeviceNode& node, ErrorCounts& errors, std::uint8_t number)
        : node_(node), errors_(errors), number_(number) {}
    ObjectDictionary& dictionary() override { return node_.dictionary(); }
    void error(std::uint16_t code, std::uint8_t register_bits, const sim::EmergencyInfo& info,
               Time now) override;
    void error_over(std::uint16_t code, Time now) override;
    void changed(std::uint16_t index, std::uint8_t sub, Time now) override { node_.changed(index, sub, now); }

   private:
    sim::DeviceNode& node_;
    ErrorCounts& errors_;
    std::uint8_t number_;
  };
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

}  // namespace cbcan::devices

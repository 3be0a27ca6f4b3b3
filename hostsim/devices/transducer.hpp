// SPDX-License-Identifier: MIT
#pragma once

/// A measuring device (CiA 404, analogue input): as many channels as its dictionary has sub-indices of 9130h.
/// The value in the world, in the unit of 6131h, becomes 9130h with the decimal digits of 6132h; 6150h says
/// what is wrong with it.

#include <cstdint>
#include <vector>

#include "devices/incidents.hpp"
#include "sim/behaviour.hpp"
#include "sim/bound.hpp"

namespace cbcan::devices {

class Transducer final : public sim::Behaviour {
 public:
  explicit Transducer(sim::DeviceNode& node);

  void reset(bool application, Time now) override;
  Time update(Time now) override;
  /// 9130h: the value in the unit of 6131h; with 6132h = 2, 12.5 shows as 1250. Every change is an event.
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) override;
  /// "sensor-break" (EMCY 5000h): process values stay as they are, and 6150h says that they are not valid.
  std::span<const std::string_view> incidents() const override;
  void set_incident(std::string_view incident, bool present, Time now) override;

 private:
  class Channel {
   public:
    Channel(ObjectDictionary& dictionary, std::uint8_t sub);
    bool exists() const { return value_.exists(); }
    void set_input(double value) { input_ = value; }
    /// True = 9130h has changed.
    bool refresh(bool broken);
    bool untold = false;

   private:
    double scale() const;

    sim::Bound<std::int32_t> value_;
    sim::Bound<std::uint8_t> decimal_digits_, status_;
    double input_;
  };

  sim::DeviceNode& node_;
  std::vector<Channel> channels_;
  Incidents incidents_;
};

}  // namespace cbcan::devices

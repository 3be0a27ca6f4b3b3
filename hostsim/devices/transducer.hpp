// SPDX-License-Identifier: MIT
#pragma once

/// A measuring device (CiA 404, analogue input): one channel for each sub-index of the process value, which is
/// INTEGER32 in 9130h, INTEGER16 in 7130h, REAL32 in 6130h; a file has one or more of them. 6130h is the input
/// value in the unit of 6131h; the others have the decimal digits of 6132h. 6150h is the status of the value.
///
/// Incident "sensor-break" (EMCY 5000h): process values remain unchanged, and 6150h shows that they are not
/// valid.

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "devices/common.hpp"
#include "sim/behaviour.hpp"
#include "sim/number.hpp"

namespace cbcan::devices {

class Transducer final : public DeviceWithIncidents {
 public:
  explicit Transducer(sim::DeviceNode& node);

  void reset(bool application, Time now) override;
  Time update(Time now) override;
  /// A process value that the file has, in the unit of 6131h; with 6132h = 2, 12.5 is shown as 1250. Every
  /// change is an event.
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) override;
  /// One input for each channel, in the widest form that it has.
  std::vector<sim::Point> points() const override;

 private:
  class Channel {
   public:
    Channel(ObjectDictionary& dictionary, std::uint8_t sub);
    bool has(std::uint16_t index) const;
    void set_input(double value) { input_ = value; }
    void refresh(bool broken);
    /// Reports the process values that have changed since the last report.
    void tell(sim::DeviceNode& node, std::uint8_t sub, Time now);
    void keep_quiet() { untold_ = {}; }
    /// Unit of the process value as the object has it; empty = not known.
    std::string_view unit() const;

   private:
    double scale() const { return std::pow(10.0, decimal_digits_.get()); }

    sim::Bound<float> real_;
    sim::Bound<std::int16_t> short_;
    sim::Bound<std::int32_t> long_;
    sim::Bound<std::uint32_t> unit_;  ///< as in CiA 303-2
    sim::Bound<std::uint8_t> decimal_digits_, status_;
    std::array<bool, 3> untold_{};  ///< changes to report: real, short, long
    double input_;
  };

  std::vector<Channel> channels_;
};

}  // namespace cbcan::devices

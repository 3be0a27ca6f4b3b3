// SPDX-License-Identifier: MIT
#pragma once

// A tank: 2001h is how far its inlet is open, in percent; 2000h its level in millimetres. Open, it fills by
// 50 mm a second; a leak takes 10. When it is full it says so.

#include <algorithm>

#include "sim/behaviour.hpp"
#include "sim/bound.hpp"

class Tank final : public cbcan::sim::Behaviour {
 public:
  explicit Tank(cbcan::sim::DeviceNode& node)
      : node_(node), level_(node.dictionary(), 0x2000, 0), inlet_(node.dictionary(), 0x2001, 0) {}

  // After power-on too. The water stays where it is, whatever is reset.
  void reset(bool /*application*/, cbcan::Time now) override {
    full_ = false;
    updated_ = now;
    level_.set(static_cast<std::uint16_t>(millimetres_));
  }

  cbcan::Time update(cbcan::Time now) override {
    // Until now the flow was the one of the last time, whatever has been written since.
    const double seconds = static_cast<double>(now - updated_) / cbcan::kSecond;
    millimetres_ = std::clamp(millimetres_ + flow_ * seconds, 0.0, kHeight);
    flow_ = 0.5 * inlet_.get() - (leaks_ ? 10 : 0);
    updated_ = now;
    show(now);
    return flow_ != 0 ? now + 100 * cbcan::kMillisecond : cbcan::kNever;
  }

  // What no length and no limit of the EDS can say.
  cbcan::AbortCode check(const cbcan::ObjectEntry& entry, std::uint8_t /*sub*/,
                         std::span<const std::uint8_t> value, cbcan::Time /*now*/) override {
    const bool opens = entry.index == 0x2001 && value[0] > 0;
    return opens && full_ ? cbcan::AbortCode::kDeviceState : cbcan::AbortCode::kNone;
  }

  std::span<const std::string_view> incidents() const override { return kIncidents; }
  void set_incident(std::string_view /*incident*/, bool present, cbcan::Time /*now*/) override {
    leaks_ = present;
  }

 private:
  void show(cbcan::Time now) {
    const auto level = static_cast<std::uint16_t>(millimetres_);
    const bool changed = level != level_.get();
    level_.set(level);
    if (changed) node_.changed(0x2000, 0, now);  // an event-driven TPDO with the level goes out
    const bool full = millimetres_ >= kHeight;
    if (full && !full_) node_.error(0xFF00, 0x81, {}, now);
    if (!full && full_) node_.error_over(0xFF00, now);
    full_ = full;
  }

  static constexpr double kHeight = 1000;
  static constexpr std::array<std::string_view, 1> kIncidents{"leak"};

  cbcan::sim::DeviceNode& node_;
  cbcan::sim::Bound<std::uint16_t> level_;
  cbcan::sim::Bound<std::uint8_t> inlet_;
  double millimetres_ = 0;
  double flow_ = 0;  // mm/s
  cbcan::Time updated_ = 0;
  bool full_ = false;
  bool leaks_ = false;
};

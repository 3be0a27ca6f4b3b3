// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "sim/behaviour.hpp"

namespace cbcan::devices {

struct ErrorKind {
  std::uint16_t code;          ///< emergency error code
  std::uint8_t register_bits;  ///< in 1001h
};

/// A device with incidents, at most 32. An unknown name is ignored.
class DeviceWithIncidents : public sim::Behaviour {
 public:
  std::span<const std::string_view> incidents() const final { return names_; }
  void set_incident(std::string_view name, bool present, Time now) final;

 protected:
  /// names[i] causes kinds[i]; both must outlive this object.
  DeviceWithIncidents(sim::DeviceNode& node, std::span<const std::string_view> names,
                      std::span<const ErrorKind> kinds)
      : node_(node), names_(names), kinds_(kinds) {}

  bool present(std::size_t incident) const { return (present_ >> incident & 1) != 0; }
  /// Reports incidents that have begun or ended to the node, if their only effect is an error with a code. The
  /// EMCY is sent again after a reset, which sets told_ to 0.
  void tell_incidents(Time now);

  sim::DeviceNode& node_;
  std::uint32_t present_ = 0;  ///< one bit each
  std::uint32_t told_ = 0;     ///< one bit for each reported error

 private:
  std::span<const std::string_view> names_;
  std::span<const ErrorKind> kinds_;
};

}  // namespace cbcan::devices

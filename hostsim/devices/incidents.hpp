// SPDX-License-Identifier: MIT
#pragma once

/// Incidents whose only effect is an error with a code: the EMCY is sent when the incident begins, and again
/// after a reset while it lasts.

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

class Incidents {
 public:
  /// names[i] belongs to kinds[i]; both must outlive this object.
  Incidents(std::span<const std::string_view> names, std::span<const ErrorKind> kinds);

  std::span<const std::string_view> names() const { return names_; }
  bool present(std::size_t incident) const { return (present_ >> incident & 1) != 0; }

  /// An unknown name is ignored.
  void set(std::string_view name, bool present);
  /// After a reset the node has no errors.
  void reset() { told_ = 0; }
  /// Reports incidents that have begun or ended to the node.
  void update(sim::DeviceNode& node, Time now) {
    if (present_ != told_) tell(node, now);
  }

 private:
  static constexpr std::size_t kMost = 32;  ///< bits of present_
  void tell(sim::DeviceNode& node, Time now);

  std::span<const std::string_view> names_;
  std::span<const ErrorKind> kinds_;
  std::uint32_t present_ = 0;  ///< one bit each
  std::uint32_t told_ = 0;     ///< one bit each
};

}  // namespace cbcan::devices

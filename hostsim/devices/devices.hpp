// SPDX-License-Identifier: MIT
#pragma once

/// The devices that a simulated node can be. docs/devices.md says what each of them does, and how to add one.

#include <cstdint>
#include <span>
#include <string_view>

#include "sim/behaviour.hpp"

namespace cbcan::devices {

struct DeviceKind {
  std::string_view name;     ///< in a plant file
  std::uint16_t profile;     ///< low 16 bits of 1000h for which it is the default; 0 = for none
  sim::BehaviourMaker make;  ///< null = the node has no behaviour
  std::string_view summary;  ///< one line, for --help
};

/// All of them; the first is "none".
std::span<const DeviceKind> device_kinds();

/// Their names, in order.
std::span<const std::string_view> device_names();

/// Null if no device has this name.
const DeviceKind* find_device(std::string_view name);

/// For the low 16 bits of 1000h (CiA 301, 7.5.2.1): "none" where no device is made for that profile.
const DeviceKind& device_for_profile(std::uint16_t profile);

}  // namespace cbcan::devices

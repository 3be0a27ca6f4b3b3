// SPDX-License-Identifier: MIT
#include "devices/devices.hpp"

#include <algorithm>
#include <array>
#include <memory>

#include "devices/drive/drive.hpp"
#include "devices/io_module.hpp"
#include "devices/transducer.hpp"

namespace cbcan::devices {

namespace {

template <class Device>
std::unique_ptr<sim::Behaviour> make(sim::DeviceNode& node, std::uint64_t /*seed*/) {
  return std::make_unique<Device>(node);
}

constexpr std::uint16_t kNoProfile = 0;

constexpr auto kKinds = std::to_array<DeviceKind>({
    {"none", kNoProfile, nullptr, "values that stay as they were written"},
    {"cia401", 401, make<IoModule>, "I/O module: digital and analogue inputs and outputs"},
    {"cia402", 402, make<Drive>,
     "drive: power state machine, motion profiles, homing, cyclic synchronous modes"},
    {"cia404", 404, make<Transducer>, "measuring device: process values with decimal digits and status"},
});

constexpr auto kNames = [] {
  std::array<std::string_view, kKinds.size()> names;
  std::ranges::transform(kKinds, names.begin(), &DeviceKind::name);
  return names;
}();

}  // namespace

std::span<const DeviceKind> device_kinds() {
  return kKinds;
}

std::span<const std::string_view> device_names() {
  return kNames;
}

const DeviceKind* find_device(std::string_view name) {
  const auto found = std::find_if(kKinds.begin(), kKinds.end(),
                                  [name](const DeviceKind& kind) { return kind.name == name; });
  return found != kKinds.end() ? &*found : nullptr;
}

const DeviceKind& device_for_profile(std::uint16_t profile) {
  const auto found = std::find_if(kKinds.begin(), kKinds.end(),
                                  [profile](const DeviceKind& kind) { return kind.profile == profile; });
  return found != kKinds.end() ? *found : kKinds.front();
}

}  // namespace cbcan::devices

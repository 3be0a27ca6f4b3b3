// SPDX-License-Identifier: MIT
#pragma once

/// What devices have in common: incidents and channels.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "sim/behaviour.hpp"

namespace cbcan::devices {

// ---- Incidents

/// What can happen to a device.
struct IncidentKind {
  std::string_view name;
  std::uint16_t code = 0;          ///< emergency error code; 0 = the incident is no error
  std::uint8_t register_bits = 0;  ///< in 1001h
  bool alarm = code != 0;          ///< something is wrong with the device
};

/// A device with incidents, at most 32.
class DeviceWithIncidents : public sim::Behaviour {
 public:
  std::vector<std::string_view> incidents() const final { return base::column(kinds_, &IncidentKind::name); }
  std::vector<std::string_view> alarms() const final {
    std::vector<std::string_view> names = incidents();
    std::erase_if(names, [this](std::string_view name) {
      return !std::ranges::find(kinds_, name, &IncidentKind::name)->alarm;
    });
    return names;
  }
  void set_incident(std::size_t place, bool present, Time /*now*/) final {
    const std::uint32_t bit = 1U << place;
    present_ = present ? present_ | bit : present_ & ~bit;
  }

 protected:
  /// `kinds` must outlive this object.
  DeviceWithIncidents(sim::DeviceNode& node, std::span<const IncidentKind> kinds)
      : node_(node), kinds_(kinds) {}

  bool present(std::size_t incident) const { return (present_ >> incident & 1) != 0; }
  /// Reports incidents that have begun or ended to the node, if their only effect is an error with a code.
  /// The EMCY is sent again after a reset, which sets told_ to 0.
  void tell_incidents(Time now) {
    std::uint32_t changed = present_ ^ told_;
    told_ = present_;
    for (std::size_t i = 0; changed != 0; ++i, changed >>= 1) {
      if ((changed & 1) == 0) continue;
      if (present(i))
        node_.error(kinds_[i].code, kinds_[i].register_bits, {}, now);
      else
        node_.error_over(kinds_[i].code, now);
    }
  }

  sim::DeviceNode& node_;
  std::uint32_t present_ = 0;  ///< one bit each
  std::uint32_t told_ = 0;     ///< one bit for each reported error

 private:
  std::span<const IncidentKind> kinds_;
};

// ---- Channels: one for each sub-index, from 1 on, of an object in the dictionary

/// Makes channels up to the highest sub-index of these objects.
template <class Channel>
std::vector<Channel> channels(ObjectDictionary& dictionary, std::initializer_list<std::uint16_t> indices) {
  unsigned highest = 0;
  for (const ObjectEntry& entry : dictionary.entries())
    if (std::ranges::count(indices, entry.index) != 0) highest = std::max<unsigned>(highest, entry.last_sub);
  std::vector<Channel> all;
  for (unsigned sub = 1; sub <= highest; ++sub)
    all.emplace_back(dictionary, static_cast<std::uint8_t>(sub));
  return all;
}

constexpr std::uint8_t sub_of(std::size_t position) {
  return static_cast<std::uint8_t>(position + 1);
}

/// Null if there is no such channel.
template <class Channel>
Channel* find(std::vector<Channel>& all, std::uint8_t sub) {
  return sub >= 1 && sub <= all.size() && all[sub - 1u].exists() ? &all[sub - 1u] : nullptr;
}

}  // namespace cbcan::devices

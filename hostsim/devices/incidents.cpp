// SPDX-License-Identifier: MIT
#include "devices/incidents.hpp"

#include <algorithm>
#include <cassert>

namespace cbcan::devices {

Incidents::Incidents(std::span<const std::string_view> names, std::span<const ErrorKind> kinds)
    : names_(names), kinds_(kinds) {
  assert(names.size() == kinds.size() && names.size() <= kMost);
}

void Incidents::set(std::string_view name, bool present) {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found != names_.end()) present_.at(static_cast<std::size_t>(found - names_.begin())) = present;
}

void Incidents::update(sim::DeviceNode& node, Time now) {
  for (std::size_t i = 0; i < kinds_.size(); ++i) {
    if (present_[i] == told_[i]) continue;
    told_[i] = present_[i];
    if (present_[i])
      node.error(kinds_[i].code, kinds_[i].register_bits, {}, now);
    else
      node.error_over(kinds_[i].code, now);
  }
}

}  // namespace cbcan::devices

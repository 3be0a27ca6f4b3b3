// SPDX-License-Identifier: MIT
#include "devices/incidents.hpp"

#include <algorithm>

namespace cbcan::devices {

void DeviceWithIncidents::set_incident(std::string_view name, bool present, Time /*now*/) {
  const auto found = std::ranges::find(names_, name);
  if (found == names_.end()) return;
  const std::uint32_t bit = 1U << (found - names_.begin());
  present_ = present ? present_ | bit : present_ & ~bit;
}

void DeviceWithIncidents::tell_incidents(Time now) {
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

}  // namespace cbcan::devices

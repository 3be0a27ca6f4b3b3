// SPDX-License-Identifier: MIT
#include "devices/incidents.hpp"

namespace cbcan::devices {

void DeviceWithIncidents::set_incident(std::size_t place, bool present, Time /*now*/) {
  const std::uint32_t bit = 1U << place;
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

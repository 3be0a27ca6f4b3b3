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
  if (found == names_.end()) return;
  const std::uint32_t bit = 1U << (found - names_.begin());
  present_ = present ? present_ | bit : present_ & ~bit;
}

void Incidents::tell(sim::DeviceNode& node, Time now) {
  const std::uint32_t changed = present_ ^ told_;
  told_ = present_;
  for (std::size_t i = 0; i < kinds_.size(); ++i) {
    if ((changed >> i & 1) == 0) continue;
    if (present(i))
      node.error(kinds_[i].code, kinds_[i].register_bits, {}, now);
    else
      node.error_over(kinds_[i].code, now);
  }
}

}  // namespace cbcan::devices

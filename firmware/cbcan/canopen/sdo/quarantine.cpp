// SPDX-License-Identifier: MIT
#include "cbcan/canopen/sdo/quarantine.hpp"

#include <algorithm>

namespace cbcan {

void SdoQuarantine::add(std::uint8_t node, sdo::Multiplexer mux, bool stream, Time until) {
  *std::ranges::min_element(slots_, {}, &Slot::until) = {until, mux, node, stream};
  empty_ = false;
}

void SdoQuarantine::release(std::uint8_t node) {
  for (Slot& slot : slots_)
    if (slot.node == node) slot.until = 0;
}

Time SdoQuarantine::held_until(std::uint8_t node, Time now) {
  Time first_free = kNever;
  Time until = now;
  std::size_t taken = 0;
  for (const Slot& slot : slots_) {
    if (slot.until <= now) continue;
    ++taken;
    first_free = earlier(first_free, slot.until);
    if (slot.node == node) until = std::max(until, slot.until);
  }
  empty_ = taken == 0;
  return taken == kSlots && until == now ? first_free : until;
}

}  // namespace cbcan

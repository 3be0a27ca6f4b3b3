// SPDX-License-Identifier: MIT
#include "canopen/node_monitor.hpp"

namespace cbcan {

bool NodeMonitor::on_frame(const Frame& frame, Time now) {
  const std::uint8_t state = frame.data[0] & nmt::kStateMask;
  if (frame.length == 0 || !nmt::is_state(state)) {
    ++counters_.ignored;
    return false;
  }
  const std::size_t node = frame.id & nmt::kMaxNode;
  const bool boot_up = state == static_cast<std::uint8_t>(nmt::State::kInitialising);
  reported_at_[node] = now;
  nodes_[node].state = boot_up ? nmt::State::kPreOperational : static_cast<nmt::State>(state);
  nodes_[node].seen = true;
  nodes_[node].doubted = false;
  ++(boot_up ? counters_.boot_ups : counters_.heartbeats);
  return boot_up;
}

void NodeMonitor::doubt(std::uint8_t node) {
  for (std::size_t i = 1; i < nodes_.size(); ++i)
    if (node == nmt::kAllNodes || node == i) nodes_[i].doubted = true;
}

bool NodeMonitor::is_fresh(std::uint8_t node, Time now) const {
  const Node& known = nodes_[node];
  const Time limit = known.consumer_ms == 0 ? fresh_for_ : milliseconds(known.consumer_ms);
  return known.seen && now - reported_at_[node] <= limit;
}

}  // namespace cbcan

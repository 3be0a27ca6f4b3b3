// SPDX-License-Identifier: MIT
#include "canopen/node_monitor.hpp"

namespace cbcan {

void NodeMonitor::doubt(std::uint8_t node) {
  for (std::size_t i = 1; i < nodes_.size(); ++i)
    if ((node == nmt::kAllNodes || node == i) && was_seen(static_cast<std::uint8_t>(i)))
      nodes_[i].report = Report::kDoubted;
}

bool NodeMonitor::is_fresh(std::uint8_t node, Time now) const {
  const Node& known = nodes_[node];
  const Time limit = known.consumer_ms == 0 ? fresh_for_ : milliseconds(known.consumer_ms);
  return was_seen(node) && now - reported_at_[node] <= limit;
}

}  // namespace cbcan

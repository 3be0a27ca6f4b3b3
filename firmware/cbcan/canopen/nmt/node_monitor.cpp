// SPDX-License-Identifier: MIT
#include "cbcan/canopen/nmt/node_monitor.hpp"

namespace cbcan {

void NodeMonitor::doubt(nmt::Command command, std::uint8_t node) {
  for (std::size_t i = 1; i < nodes_.size(); ++i) {
    Node& told = nodes_[i];
    if ((node != nmt::kAllNodes && node != i) || told.report == Report::kNone) continue;
    told.state |= kDoubted;
    if (command >= nmt::Command::kResetNode)
      told.report = command == nmt::Command::kResetNode ? Report::kResetNode : Report::kResetCommunication;
  }
}

void NodeMonitor::watch_nobody() {
  for (Node& node : nodes_)
    node.consumer_ms = 0;
  guarded_.clear();
}

bool NodeMonitor::is_fresh(std::uint8_t node, Time now) const {
  const Node& known = nodes_[node];
  const Time limit = known.consumer_ms == 0 ? fresh_for_ : milliseconds(known.consumer_ms);
  return was_seen(node) && now - reported_at_[node] <= limit;
}

}  // namespace cbcan

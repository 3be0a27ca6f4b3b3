// SPDX-License-Identifier: MIT
#include "cbcan/canopen/nmt/node_monitor.hpp"

namespace cbcan {

// Not a call for each of all nodes.
[[gnu::always_inline]] inline void NodeMonitor::Node::doubt(nmt::Command command) {
  if (report == Report::kNone) return;
  state |= kDoubted;
  if (command >= nmt::Command::kResetNode)
    report = command == nmt::Command::kResetNode ? Report::kResetNode : Report::kResetCommunication;
}

void NodeMonitor::doubt(nmt::Command command, std::uint8_t node) {
  if (node > nmt::kMaxNode) return;
  if (node != nmt::kAllNodes) return nodes_[node].doubt(command);
  for (Node& told : nodes_)
    told.doubt(command);
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

// SPDX-License-Identifier: MIT
#include "cbcan/canopen/nmt/node_monitor.hpp"

#include <span>

namespace cbcan {

void NodeMonitor::doubt(nmt::Command command, std::uint8_t node) {
  if (node > nmt::kMaxNode) return;
  const auto addressed = node == nmt::kAllNodes ? std::span(nodes_) : std::span(nodes_).subspan(node, 1);
  for (Node& told : addressed) {
    if (told.report == Report::kNone) continue;
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

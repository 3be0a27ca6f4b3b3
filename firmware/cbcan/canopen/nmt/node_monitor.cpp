// SPDX-License-Identifier: MIT
#include "cbcan/canopen/nmt/node_monitor.hpp"

namespace cbcan {

void NodeMonitor::doubt(nmt::Command command, std::uint8_t node) {
  if (node > nmt::kMaxNode) return;
  if (node == nmt::kAllNodes) return doubt_all(command);
  state_[node] |= kDoubted;
  if (command >= nmt::Command::kResetNode && was_seen(node)) report_[node] = report_after(command);
}

/// Four nodes at a time, as a port waits meanwhile.
void NodeMonitor::doubt_all(nmt::Command command) {
  std::uint32_t four = 0;
  for (std::size_t node = 0; node != state_.size(); node += sizeof four) {
    __builtin_memcpy(&four, &state_[node], sizeof four);
    four |= kDoubted * 0x01010101u;
    __builtin_memcpy(&state_[node], &four, sizeof four);
  }
  if (command < nmt::Command::kResetNode) return;
  for (Report& report : report_)
    if (report != Report::kNone) report = report_after(command);
}

NodeMonitor::Report NodeMonitor::report_after(nmt::Command reset) {
  return reset == nmt::Command::kResetNode ? Report::kResetNode : Report::kResetCommunication;
}

void NodeMonitor::watch_nobody() {
  consumer_ms_.fill(0);
  guarded_.clear();
}

bool NodeMonitor::is_fresh(std::uint8_t node, Time now) const {
  const Time limit = consumer_ms_[node] == 0 ? fresh_for_ : milliseconds(consumer_ms_[node]);
  return was_seen(node) && now - reported_at_[node] <= limit;
}

}  // namespace cbcan

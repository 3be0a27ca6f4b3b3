// SPDX-License-Identifier: MIT
#include "cbcan/canopen/nmt/node_monitor.hpp"

namespace cbcan {

void NodeMonitor::doubt(nmt::Command command, std::uint8_t node) {
  if (node > nmt::kMaxNode) return;
  if (node == nmt::kAllNodes) return doubt_all(command);
  of_.state[node] |= kDoubted;
  if (command >= nmt::Command::kResetNode && was_seen(node)) of_.report[node] = report_after(command);
}

/// Four nodes at a time, as the port waits for this.
void NodeMonitor::doubt_all(nmt::Command command) {
  std::uint32_t four = 0;
  for (std::size_t node = 0; node != of_.state.size(); node += sizeof four) {
    __builtin_memcpy(&four, &of_.state[node], sizeof four);
    four |= kDoubted * 0x01010101u;
    __builtin_memcpy(&of_.state[node], &four, sizeof four);
  }
  if (command < nmt::Command::kResetNode) return;
  for (Report& report : of_.report)
    if (report != Report::kNone) report = report_after(command);
}

NodeMonitor::Report NodeMonitor::report_after(nmt::Command reset) {
  return reset == nmt::Command::kResetNode ? Report::kResetNode : Report::kResetCommunication;
}

void NodeMonitor::stop_watching() {
  of_.consumer_ms.fill(0);
  guarded_.clear();
}

bool NodeMonitor::is_fresh(std::uint8_t node, Time now) const {
  const Time limit = of_.consumer_ms[node] == 0 ? fresh_for_ : milliseconds(of_.consumer_ms[node]);
  return was_seen(node) && now - of_.reported_at[node] <= limit;
}

}  // namespace cbcan

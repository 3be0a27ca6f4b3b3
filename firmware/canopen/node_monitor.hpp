// SPDX-License-Identifier: MIT
#pragma once

/// What is known of the other nodes from their boot-up, heartbeat and node guarding messages (CiA
/// 301, 7.2.8.2.2 and 7.2.8.3.2). A message costs one array access; time passing costs nothing: how old the
/// news are is found when somebody asks.

#include <array>
#include <cstdint>

#include "canopen/nmt.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class NodeMonitor {
 public:
  struct Counters {
    std::uint32_t boot_ups = 0;
    std::uint32_t heartbeats = 0;  ///< heartbeats and node guarding answers
    std::uint32_t ignored = 0;     ///< no state in it, or no such state
  };

  /// `fresh_for`: how long news count where no consumer heartbeat time is set.
  explicit NodeMonitor(Time fresh_for) : fresh_for_(fresh_for) {}

  /// A data frame with CAN-ID 700h + 1..127. True when it was a boot-up message.
  bool on_frame(const Frame& frame, Time now);

  /// Consumer heartbeat time (1016h) of a node, 1..127; 0 = none.
  void set_consumer_time(std::uint8_t node, std::uint16_t ms) { nodes_[node].consumer_ms = ms; }
  std::uint16_t consumer_time(std::uint8_t node) const { return nodes_[node].consumer_ms; }

  /// An NMT command has gone out to this node, 0 = to all: what it reported before may no longer be so.
  void doubt(std::uint8_t node);
  bool in_doubt(std::uint8_t node) const { return nodes_[node].doubted; }

  /// The last reported state is recent enough to be believed.
  bool is_fresh(std::uint8_t node, Time now) const;

  /// The node has reported at least once.
  bool was_seen(std::uint8_t node) const { return nodes_[node].seen; }

  /// The last reported state; a boot-up counts as pre-operational.
  nmt::State last_state(std::uint8_t node) const { return nodes_[node].state; }

  const Counters& counters() const { return counters_; }

 private:
  struct Node {
    std::uint16_t consumer_ms = 0;
    nmt::State state = nmt::State::kInitialising;
    bool seen : 1 = false;
    bool doubted : 1 = false;
  };

  // Times apart from the rest: 64-bit alignment would cost four bytes for every node.
  std::array<Time, nmt::kMaxNode + 1> reported_at_{};
  std::array<Node, nmt::kMaxNode + 1> nodes_{};
  Time fresh_for_;
  Counters counters_;
};

}  // namespace cbcan

// SPDX-License-Identifier: MIT
#pragma once

/// R3928..R4099: the states of all nodes as registers (docs/reference/contract.md, "Network status"). Kept up
/// to date at each event, so a response to a read shows one moment; reading changes nothing. What the PLC
/// writes there is replaced immediately, except that a 1 clears a bit of "EMCY", of "lost since", or R3928
/// bit 8.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/emcy/emergency_consumer.hpp"
#include "cbcan/canopen/manager/manager.hpp"
#include "cbcan/canopen/nmt/node_monitor.hpp"
#include "cbcan/canopen/nmt/node_set.hpp"
#include "cbcan/coprocessor/register_window.hpp"

namespace cbcan {

class NetworkStatus {
 public:
  /// All outlive it.
  NetworkStatus(const Device& own, const NodeMonitor& monitor, const Emergencies& emergencies,
                Manager& manager)
      : own_(own), monitor_(monitor), emergencies_(emergencies), manager_(manager) {}

  /// The caller's memory, which outlives it; without it there are no such registers.
  void show_in(StatusRegisters words, NodeRequestRegisters requests);

  /// Something about this node has changed; 0 = about the module.
  void update(std::uint8_t node);
  /// A node has reported: without effect if its register shows this state. A boot-up message ends its error.
  void on_report(std::uint8_t node, NodeMonitor::News news) {
    if (news == NodeMonitor::News::kBootUp && in_error_.has(node)) forget_emergency(node);
    if (!words_.empty() && (words_[regmap::kStatusNodes + node] & 0xFF) != state_of(node)) update(node);
  }
  void on_emergency(std::uint8_t node);
  /// The messages stay in 3005h.
  void forget_emergency(std::uint8_t node);
  void forget_emergencies();
  void on_bus_state(BusState state);
  void on_plc_lost();
  /// The PLC has written words first..first+count-1.
  void on_written(std::size_t first, std::size_t count);
  /// The PLC has written a request to a node: it is executed.
  void on_request(Time now);

 private:
  bool is_heard(std::uint8_t node) const;
  std::uint8_t state_of(std::uint8_t node) const;
  std::uint16_t step_of(std::uint8_t node) const;
  std::uint16_t summary() const;
  bool command(regmap::NodeRequest request, std::uint8_t node, Time now);
  std::uint16_t detail(regmap::NodeRequest request, std::uint8_t node) const;
  void put(std::size_t word, std::uint16_t value);
  void put_bit(regmap::StatusMap map, std::uint8_t node, bool value);

  const Device& own_;
  const NodeMonitor& monitor_;
  const Emergencies& emergencies_;
  Manager& manager_;
  std::span<std::uint16_t> words_;
  std::span<std::uint16_t> requests_;
  std::uint16_t changes_ = 0;
  bool plc_was_lost_ = false;
  bool bus_off_ = false;
  NodeSet unlisted_;   ///< nodes that have reported and are not listed
  NodeSet unwatched_;  ///< nodes that run, and have neither heartbeat nor node guarding
  NodeSet in_error_;   ///< nodes whose last EMCY message is an error, and has not been forgotten
};

}  // namespace cbcan

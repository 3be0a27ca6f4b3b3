// SPDX-License-Identifier: MIT
#pragma once

/// A CANopen master: boots and supervises the nodes of network.toml, and reads and writes their objects.

#include "cbcan/canopen/eds_device.hpp"
#include "cbcan/canopen/manager/manager.hpp"
#include "network.hpp"
#include "own_node.hpp"

class Master final : public cbcan::EdsDeviceOf<own_node::kDictionary>, private cbcan::ManagerApplication {
 public:
  explicit Master(cbcan::CanPort& port)
      : EdsDeviceOf(port), client(port, data_), manager_(device(), monitor_, port, *this) {}

  void start(cbcan::Time now) {
    manager_.use(kNetwork);
    EdsDeviceOf::start(kNodeId, now);
  }

  void on_frame(const cbcan::Frame& frame, cbcan::Time now) {
    const auto node = static_cast<std::uint8_t>(frame.id & cbcan::nmt::kMaxNode);
    const std::uint32_t kind = frame.id - node;
    if (kind == cbcan::sdo::kResponseId && node != 0) {
      if (!manager_.on_response(frame, now)) client.on_frame(frame, now);
    } else if (kind == cbcan::nmt::kErrorControlId && node != kNodeId && frame.flags == 0) {
      report(frame, monitor_.on_frame(frame, now), now);
    } else {
      EdsDeviceOf::on_frame(frame, now);
    }
  }

  cbcan::Time poll(cbcan::Time now) {
    client.poll(now);
    manager_.poll(now);
    const cbcan::Time due = EdsDeviceOf::poll(now);  // may begin a boot: before the others' deadlines
    return cbcan::earlier(due, cbcan::earlier(client.deadline(), manager_.deadline()));
  }

  /// Booted, supervised and Operational.
  bool runs(std::uint8_t node) const { return manager_.phase(node) == cbcan::Manager::Phase::kRun; }
  /// An SDO request to it may begin.
  bool is_free(std::uint8_t node, cbcan::Time now) {
    return !client.busy() && manager_.node_free_from(node, now) <= now;
  }

 private:
  static constexpr std::uint8_t kNodeId = 127;

  void report(const cbcan::Frame& frame, cbcan::NodeMonitor::News news, cbcan::Time now) {
    const auto node = static_cast<std::uint8_t>(frame.id & cbcan::nmt::kMaxNode);
    if (news == cbcan::NodeMonitor::News::kNone) return;
    if (news == cbcan::NodeMonitor::News::kBootUp) client.on_boot_up(node, now);
    manager_.on_report(frame, news, now);
  }

  // The own node.
  void on_state(cbcan::nmt::State state, cbcan::Time now) override {
    EdsDeviceOf::on_state(state, now);
    manager_.on_own_state(state, now);
  }
  /// 1016h, which the network file sets: the nodes to be watched.
  void on_stored(const cbcan::ObjectEntry& entry, std::uint8_t sub, cbcan::Time now) override {
    EdsDeviceOf::on_stored(entry, sub, now);
    if (entry.index != cbcan::object::kConsumerHeartbeatTime) return;
    const std::uint64_t value = get({entry.index, sub});
    monitor_.set_consumer_time(static_cast<std::uint8_t>(value >> 16), static_cast<std::uint16_t>(value));
  }

  // The manager shares the nodes' SDO servers with `client`.
  cbcan::Time node_free_from(std::uint8_t node, cbcan::Time now) override {
    return client.node_free_from(node, now);
  }
  void on_node(std::uint8_t /*node*/) override {}

  std::array<std::uint8_t, 128> data_{};
  cbcan::NodeMonitor monitor_{2 * cbcan::kSecond};

 public:
  cbcan::SdoClient client;

 private:
  cbcan::Manager manager_;
};

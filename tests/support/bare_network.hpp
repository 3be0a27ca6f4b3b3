// SPDX-License-Identifier: MIT
#pragma once

#include "plant/network.hpp"

namespace cbcan::test {

/// Time for networks, moved by a test.
class ByHand final : private plant::NetworkListener {
 public:
  Time now = 0;

  plant::NetworkContext context() { return {now, schedule_, *this}; }
  /// As a program in real time does without requests from clients.
  void poll_what_is_due_until(Time end) {
    while (schedule_.first_time() < end) {
      now = std::max(now, schedule_.first_time());
      schedule_.poll(now);
    }
    now = end;
  }

 private:
  void on_fault(std::size_t /*network*/, std::string_view /*text*/, Time /*now*/) override {}

  sim::Schedule schedule_;
};

/// A network without a module, for tests that add nodes.
class BareNetwork {
  static config::Config config_of(std::uint32_t bit_rate) {
    config::Config config;
    config.networks.front().can.bit_rate = bit_rate;
    config.networks.front().module.enabled = false;
    return config;
  }

  config::Config config_;
  ByHand driver_;

 public:
  explicit BareNetwork(std::uint32_t bit_rate = 0) : config_(config_of(bit_rate)) {}

  Time& now = driver_.now;
  plant::Network network{config_, config_.networks.front(), {}, driver_.context()};
};

}  // namespace cbcan::test

// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/window.hpp"
#include "config/config.hpp"
#include "config/run_options.hpp"
#include "io/loop/reactor.hpp"
#include "plant/control.hpp"

namespace cbcan::app {

/// Any implementation of the register window, as a Modbus server in real time. Supports commands for
/// registers, and conditions on registers, transactions and time. Blocks.
class Target final : public plant::Bench, private plant::View {
 public:
  /// Throws io::EnvironmentError without a connection, as do all functions when it is lost.
  explicit Target(const config::TargetPlace& place);

  plant::View& view() override { return *this; }
  void check(std::string_view line) override;
  std::string execute(std::string_view line) override;
  void advance(Time until) override;

 private:
  Time now() const override { return io::Reactor::now() - started_; }
  Time started() const override { return started_; }
  std::size_t networks() const override { return config::kMostNetworks; }
  std::vector<std::uint16_t> read(std::size_t network, std::uint32_t first, std::size_t count) override;
  std::uint32_t transactions(std::size_t /*network*/) override { return transactions_; }
  sim::World& world(std::size_t network) override;
  bool has_exact_time() const override { return false; }
  window::Response exchange(std::size_t network, const window::Request& request);
  void check_own(std::size_t network);

  io::Reactor reactor_;
  window::Client client_;
  Time started_ = io::Reactor::now();
  std::uint32_t transactions_ = 0;
  /// R3700.. of the transaction in progress, by network.
  std::map<std::size_t, std::vector<std::uint16_t>> written_;
};

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

/// cbcan-sim put together: registers, module, nodes and bus of a World, with Modbus TCP in front of it, a CAN
/// interface or nothing behind it, and the clock of this machine to drive it.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/config.hpp"
#include "cbcan/regmap.hpp"
#include "io/candump_log.hpp"
#include "io/modbus_tcp.hpp"
#include "io/reactor.hpp"
#include "io/socketcan.hpp"
#include "io/stop_signals.hpp"
#include "sim/world.hpp"

namespace cbcan::app {

class Simulator {
 public:
  /// `images` has one image for each node of `config`, in their order. Opens everything; throws
  /// io::EnvironmentError.
  Simulator(const Config& config, std::vector<sim::NodeImage> images, const io::Warn& warn);

  /// "modbus=127.0.0.1:1502 can=virtual", with the real port.
  std::string where() const;

  /// Serves until SIGINT or SIGTERM.
  void run();

  /// What has happened, in lines for people.
  std::string summary() const;

 private:
  void advance(Time now);
  Time next_deadline() const;

  std::string can_;
  std::vector<std::uint16_t> registers_ = std::vector<std::uint16_t>(regmap::kRegisterFileWords);
  io::Reactor reactor_;
  io::StopSignals signals_;
  sim::World world_;
  sim::Module& module_;
  std::optional<io::CandumpLog> log_;
  std::optional<io::SocketCan> socketcan_;
  io::ModbusTcp modbus_;
};

}  // namespace cbcan::app

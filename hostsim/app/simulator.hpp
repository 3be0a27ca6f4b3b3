// SPDX-License-Identifier: MIT
#pragma once

/// cbcan-sim put together: its CAN networks with Modbus TCP in front of them, commands at run time, and a
/// clock to drive them: this machine's, or one that stands still but for `pass` lines on standard input.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/control.hpp"
#include "app/network.hpp"
#include "io/command_server.hpp"
#include "io/line_input.hpp"
#include "io/modbus_tcp.hpp"
#include "io/reactor.hpp"
#include "io/stop_signals.hpp"
#include "plant/build_node.hpp"
#include "plant/config.hpp"

namespace cbcan::app {

class Simulator {
 public:
  /// `nodes` has a list for each network of `config`, with one for each of its nodes, in their order. Opens
  /// everything; throws io::EnvironmentError, or io::UsageError for a parameter file that cannot be
  /// understood.
  Simulator(const plant::Config& config, std::vector<std::vector<plant::BuiltNode>> nodes,
            const io::Warn& warn);

  /// "modbus=127.0.0.1:1502 can=virtual slcan=127.0.0.1:29536 2/can=virtual", with the real ports; what is
  /// not served is left out.
  std::string where() const;

  /// Serves until SIGINT or SIGTERM; on a manual clock also until standard input ends. Throws io::UsageError
  /// for a line that means nothing.
  void run();

  /// What has happened, in lines for people.
  std::string summary() const;

 private:
  /// Before a line of input, what has come in until then is dealt with: so many turns of it at most, lest
  /// clients that never stop asking stop the clock.
  static constexpr int kMostTurnsBeforeLine = 100;

  void open_networks(const plant::Config& config, std::vector<std::vector<plant::BuiltNode>> nodes);
  void open_modbus(const plant::Config& config);
  void open_control(const plant::Config& config);
  std::size_t turn(Time until);
  void take_input();
  void take_line(const std::string& line);
  void pass(Time duration);
  std::string execute(std::string_view line);
  void flush();
  void advance();
  Time now() const { return input_ ? now_ : io::Reactor::now(); }
  Time next_deadline() const;

  io::Warn warn_;
  io::Reactor reactor_;
  io::StopSignals signals_;
  Time started_;
  std::vector<std::unique_ptr<Network>> networks_;
  std::optional<Control> control_;
  std::optional<io::CommandServer> commands_;
  std::optional<io::ModbusTcp> modbus_;
  std::optional<io::LineInput> input_;  ///< there = the clock is manual
  Time now_ = 0;                        ///< of the manual clock
};

}  // namespace cbcan::app

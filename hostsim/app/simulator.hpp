// SPDX-License-Identifier: MIT
#pragma once

/// cbcan-sim put together: its CAN networks with Modbus TCP in front of them, commands at run time, and a
/// clock to drive them: this machine's, or one that stands still but for `pass` lines on standard input.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/config.hpp"
#include "app/control.hpp"
#include "app/network.hpp"
#include "app/node_image.hpp"
#include "io/loop/line_input.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/stop_signals.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "io/sockets/command_server.hpp"

namespace cbcan::app {

class Simulator {
 public:
  /// `nodes` has a list for each network of `config`, with one for each of its nodes, in their order. Opens
  /// everything; throws io::EnvironmentError, or io::UsageError for a parameter file that cannot be
  /// understood.
  Simulator(const Config& config, std::vector<std::vector<BuiltNode>> nodes, const io::Warn& warn);

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

  void open_networks(const Config& config, std::vector<std::vector<BuiltNode>> nodes);
  void open_modbus(const Config& config);
  void open_control(const Config& config);
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

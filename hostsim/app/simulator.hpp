// SPDX-License-Identifier: MIT
#pragma once

/// cbcan-sim put together: registers, module, nodes and bus of a World, with Modbus TCP in front of it, a CAN
/// interface, SLCAN adapters or nothing behind it, commands at run time, and a clock to drive it: this
/// machine's, or one that stands still but for `pass` lines on standard input.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/config.hpp"
#include "app/control.hpp"
#include "app/node_image.hpp"
#include "cbcan/regmap.hpp"
#include "io/candump_log.hpp"
#include "io/command_server.hpp"
#include "io/line_input.hpp"
#include "io/modbus_tcp.hpp"
#include "io/parameter_file.hpp"
#include "io/reactor.hpp"
#include "io/slcan_server.hpp"
#include "io/socketcan.hpp"
#include "io/stop_signals.hpp"
#include "sim/world.hpp"

namespace cbcan::app {

class Simulator final : private sim::FaultListener {
 public:
  /// `nodes` has one for each node of `config`, in their order. Opens everything; throws
  /// io::EnvironmentError, or io::UsageError for a parameter file that cannot be understood.
  Simulator(const Config& config, std::vector<BuiltNode> nodes, const io::Warn& warn);

  /// "modbus=127.0.0.1:1502 can=virtual slcan=127.0.0.1:29536", with the real ports; what is not served is
  /// left out.
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

  void add_nodes(const Config& config, std::vector<BuiltNode> nodes);
  void set_faults(const Config& config);
  void tell_time_of_day();
  void open_slcan(const Config& config);
  void open_control(const Config& config);
  void open_log(const Config& config);
  std::size_t turn(Time until);
  void take_input();
  void take_line(const std::string& line);
  void pass(Time duration);
  std::string execute(std::string_view line);
  void on_request(bool wrote);
  void on_fault(std::string_view text, Time now) override;
  void flush();
  void advance();
  Time now() const { return input_ ? now_ : io::Reactor::now(); }
  Time next_deadline() const;

  std::string can_;
  io::Warn warn_;
  std::vector<std::uint16_t> registers_ = std::vector<std::uint16_t>(regmap::kRegisterFileWords);
  io::Reactor reactor_;
  io::StopSignals signals_;
  Time started_;
  sim::World world_;
  sim::Module* module_ = nullptr;
  std::vector<std::unique_ptr<io::ParameterFile>> parameters_;
  std::vector<PlantNode> nodes_;
  Control control_;
  std::optional<io::CandumpLog> log_;
  std::optional<io::SocketCan> socketcan_;
  std::optional<io::SlcanServer> slcan_;
  std::optional<io::CommandServer> commands_;
  std::optional<io::ModbusTcp> modbus_;
  std::optional<io::LineInput> input_;  ///< there = the clock is manual
  Time now_ = 0;                        ///< of the manual clock
};

}  // namespace cbcan::app

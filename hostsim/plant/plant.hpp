// SPDX-License-Identifier: MIT
#pragma once

/// A plant inside this process, in virtual time: networks, nodes, modules, without a socket. What the plant
/// file says about Modbus, SocketCAN, SLCAN, logs and files of parameters is left out; what nodes store lasts
/// as long as the plant.

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "config/build_node.hpp"
#include "config/config.hpp"
#include "plant/control.hpp"
#include "plant/wires.hpp"

namespace cbcan::plant {

/// What a scenario is played on.
class Bench {
 public:
  virtual ~Bench() = default;
  virtual View& view() = 0;
  /// Throws Refused for a command that means nothing here, as far as that can be told without executing it.
  virtual void check(std::string_view line) = 0;
  /// A command of docs/reference/commands.md; what it brings about has happened when it returns the response. wait and
  /// pass let time pass.
  virtual std::string execute(std::string_view line) = 0;
  /// Lets time pass to when something happens next, or only to `until`, both since the plant's start.
  virtual void step(Time until) = 0;
  virtual void add(Listener& listener) = 0;
  virtual void remove(Listener& listener) = 0;
  /// What nodes and faults have said last, lines with the time.
  virtual std::vector<std::string> said() const { return {}; }
};

class Plant final : public Bench, private sim::FaultListener {
 public:
  /// Is told before it is this time; nobody has to be.
  using Pace = std::function<void(Time)>;

  /// `build` is all that config::build_nodes() has made of `config`. All nodes are off until start().
  Plant(const config::Config& config, config::PlantBuild build, Pace pace = {});

  void start();

  View& view() override { return control_; }
  Control& control() { return control_; }
  void check(std::string_view line) override { check_command(line); }
  std::string execute(std::string_view line) override;
  void step(Time until) override;
  void add(Listener& listener) override { control_.add(listener); }
  void remove(Listener& listener) override { control_.remove(listener); }
  std::vector<std::string> said() const override { return said_; }

  Time now() const { return control_.now(); }
  /// Until it is this time.
  void pass_to(Time time);

 private:
  std::vector<std::unique_ptr<Network>> make_networks(const config::Config& config, config::PlantBuild build);
  static std::vector<Network*> pointers(const std::vector<std::unique_ptr<Network>>& networks);
  void advance(Time time);
  void on_fault(std::string_view text, Time now) override;

  std::vector<std::string> said_;
  std::vector<std::unique_ptr<Network>> networks_;
  Wires wires_;
  Control control_;
  Pace pace_;
};

}  // namespace cbcan::plant

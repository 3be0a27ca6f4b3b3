// SPDX-License-Identifier: MIT
#pragma once

/// A plant inside this process: networks with their nodes and modules, wires, commands; without sockets.

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "config/build_node.hpp"
#include "config/config.hpp"
#include "plant/control.hpp"
#include "plant/network.hpp"

namespace cbcan::plant {

class Plant {
 public:
  /// The store for the parameters of a module or node, by the file's name; null = none.
  using FindStore = std::function<sim::ParameterStore*(const std::string& file)>;

  /// `build` is the result of config::build_nodes() for `config`. All nodes are off until start(). `now` never
  /// goes back; it, the listener and the stores outlive the plant.
  Plant(const config::Config& config, config::PlantBuild build, const Time& now, NetworkListener& listener,
        const FindStore& find_store);
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;

  /// `observed`: see Network::start().
  void start(bool observed);
  /// All networks, to the present time.
  void advance();
  /// Earliest deadline of all networks.
  Time next_deadline() const { return sim::earliest(networks_, &Network::next_deadline); }
  /// Polls what is due, in order of time.
  sim::Schedule& schedule() { return schedule_; }
  const sim::Schedule& schedule() const { return schedule_; }

  Control& control() { return *control_; }
  const std::vector<std::unique_ptr<Network>>& networks() const { return networks_; }

 private:
  sim::Schedule schedule_;
  std::vector<std::unique_ptr<Network>> networks_;
  std::optional<Wires> wires_;
  std::optional<Control> control_;
};

/// A plant in virtual time. Settings for Modbus, SocketCAN, SLCAN and logs are ignored. Of parameter files it
/// has copies, which last as long as the plant.
class VirtualPlant final : public Bench, private NetworkListener {
 public:
  /// Called before time passes to this time; may be empty.
  using Pace = std::function<void(Time)>;

  /// See Plant. Throws base::UsageError for an invalid parameter file.
  VirtualPlant(const config::Config& config, config::PlantBuild build, Pace pace = {});

  void start() { plant_.start(false); }

  View& view() override { return control(); }
  Control& control() { return plant_.control(); }
  void check(std::string_view line) override { check_command(line); }
  std::string execute(std::string_view line) override;
  void advance(Time until) override;
  std::vector<std::string> said() const override { return said_; }

  Time now() const { return now_; }
  /// Lets time pass to this time.
  void advance_to(Time time);

 private:
  void set_time(Time time);
  void on_fault(std::size_t network, std::string_view text, Time now) override;

  Time now_ = 0;
  std::vector<std::string> said_;
  sim::ParameterCopies parameters_;
  Plant plant_;
  Pace pace_;
};

}  // namespace cbcan::plant

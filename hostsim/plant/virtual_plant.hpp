// SPDX-License-Identifier: MIT
#pragma once

/// A plant in virtual time. Settings for Modbus, SocketCAN, SLCAN and logs are ignored. Of parameter files it
/// has copies, which last as long as the plant.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "plant/bench.hpp"
#include "plant/plant.hpp"

namespace cbcan::plant {

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

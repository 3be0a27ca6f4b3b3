// SPDX-License-Identifier: MIT
#pragma once

/// Turns a live session into a scenario: what the PLC writes, what commands do, and what has come of
/// transactions.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "io/loop/output.hpp"
#include "scenario/control.hpp"

namespace cbcan::app {

/// `plant_file` as a scenario that may stand anywhere names it: an absolute path, "demo" or nothing.
std::string plant_in_scenario(const std::string& plant_file);

class Recorder {
 public:
  /// `plant`: as plant_in_scenario() has it; empty = none, as options alone have made it. Throws
  /// io::EnvironmentError where the file cannot be written. The control outlives it.
  Recorder(const std::string& path, const std::string& plant, scenario::Control& control);

  /// The PLC has written these, which has had no effects yet.
  void on_written(std::size_t network, std::size_t first, std::span<const std::uint16_t> words);
  /// Commands may have been given, transactions may have ended.
  void look();

 private:
  void add_step(Time at, std::string_view keys);
  void on_ended(const journal::Event& event);

  scenario::Control& control_;
  io::Output file_;
  journal::Cursor cursor_;
};

}  // namespace cbcan::app

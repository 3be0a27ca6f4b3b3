// SPDX-License-Identifier: MIT
#pragma once

/// --record: the scenario of this session, written while it goes on.

#include <cstdint>
#include <span>
#include <string>

#include "io/loop/output.hpp"
#include "scenario/scenario_writer.hpp"

namespace cbcan::app {

class Recorder {
 public:
  /// Throws io::EnvironmentError where the file cannot be written. The control outlives it.
  Recorder(const std::string& path, const std::string& plant, plant::Control& control,
           journal::FindName find);

  /// The PLC has written these, which has had no effects yet.
  void on_written(std::size_t network, std::size_t first, std::span<const std::uint16_t> words);
  /// Commands may have been given, transactions may have ended.
  void poll();

 private:
  plant::Control& control_;
  scenario::ScenarioWriter writer_;
  io::Output file_;
  journal::Cursor cursor_;
};

}  // namespace cbcan::app

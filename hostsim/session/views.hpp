// SPDX-License-Identifier: MIT
#pragma once

/// Views of the journal from the start on: lines for standard error (-v, -vv), and the session as a scenario
/// (--record).

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "journal/event_text.hpp"
#include "journal/journal.hpp"
#include "plant/control.hpp"
#include "scenario/scenario_writer.hpp"

namespace cbcan::session {

/// Takes whole lines.
using Tell = std::function<void(std::string_view lines)>;

/// Writes a line for each ended transaction, state and EMCY message, and with `frames` for each frame.
class Trace {
 public:
  Trace(plant::Control& control, journal::FindName find, bool frames, Tell tell);

  /// Writes new events.
  void poll();

 private:
  plant::Control& control_;
  journal::FindName find_;
  Tell tell_;
  journal::Cursor cursor_;
  base::Buffer lines_;
};

/// Writes this session as a scenario while it runs.
class Recorder {
 public:
  /// `plant`: see ScenarioWriter::opening(). The control outlives it.
  Recorder(plant::Control& control, journal::FindName find, const std::string& plant, Tell tell);

  /// The PLC has written these, without effects so far.
  void on_written(std::size_t network, std::size_t first, std::span<const std::uint16_t> words);
  /// Call it after commands and ends of transactions.
  void poll();

 private:
  plant::Control& control_;
  scenario::ScenarioWriter writer_;
  Tell tell_;
  journal::Cursor cursor_;
};

}  // namespace cbcan::session

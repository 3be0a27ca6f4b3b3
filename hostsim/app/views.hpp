// SPDX-License-Identifier: MIT
#pragma once

/// Views of the journal from the start on: lines on standard error (-v, -vv), a pcapng file, and the session as
/// a scenario (--record).

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "config/config.hpp"
#include "io/files/pcap_file.hpp"
#include "journal/journal.hpp"
#include "journal/words.hpp"
#include "plant/control.hpp"
#include "scenario/scenario_writer.hpp"

namespace cbcan::app {

/// Finds the name of an object in the EDS file of the node that has the node ID now; `control` outlives it.
journal::FindName names_of(plant::Control& control);

/// Writes a line for each ended transaction, state and EMCY message, and with `frames` for each frame.
class Trace {
 public:
  /// `tell` takes whole lines.
  Trace(plant::Control& control, journal::FindName find, bool frames,
        std::function<void(std::string_view lines)> tell);

  /// Writes new events.
  void poll();

 private:
  plant::Control& control_;
  journal::FindName find_;
  std::function<void(std::string_view)> tell_;
  journal::Cursor cursor_;
};

/// Writes this session as a scenario while it runs.
class Recorder {
 public:
  /// Throws io::EnvironmentError if the file cannot be written. The control outlives it.
  Recorder(const std::string& path, const std::string& plant, plant::Control& control,
           journal::FindName find);

  /// The PLC has written these, without effects so far.
  void on_written(std::size_t network, std::size_t first, std::span<const std::uint16_t> words);
  /// Call it after commands and ends of transactions.
  void poll();

 private:
  plant::Control& control_;
  scenario::ScenarioWriter writer_;
  io::Output file_;
  journal::Cursor cursor_;
};

/// The comment of a packet: the number of the transaction, its text at begin and end, or a fault's text.
std::string packet_comment(const journal::Event& event, const journal::Journal& journal,
                           const journal::FindName& find);

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#pragma once

/// Views of the journal that are there from the start: lines on standard error (-v, -vv), a pcapng file, and
/// the session as a scenario (--record).

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

/// Names of objects as the EDS files of the nodes have them that have these node IDs now; `control` outlives
/// it.
journal::FindName names_of(plant::Control& control);

/// Transactions that have ended, states and EMCY messages, a line each, and with `frames` all frames.
class Trace {
 public:
  /// `tell` takes whole lines.
  Trace(plant::Control& control, journal::FindName find, bool frames,
        std::function<void(std::string_view lines)> tell);

  /// Tells what has happened.
  void poll();

 private:
  plant::Control& control_;
  journal::FindName find_;
  std::function<void(std::string_view)> tell_;
  journal::Cursor cursor_;
};

/// The scenario of this session, written while it goes on.
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

/// What a packet's comment says: the transaction, with what it is at its beginning; faults in words.
std::string packet_comment(const journal::Event& event, const journal::Journal& journal,
                           const journal::FindName& find);

}  // namespace cbcan::app

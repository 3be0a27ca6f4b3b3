// SPDX-License-Identifier: MIT
#pragma once

/// Turns a session into a scenario: register writes of the PLC, commands, and results of transactions.

#include <cstdint>
#include <deque>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "base/buffer.hpp"
#include "journal/event_text.hpp"
#include "plant/control.hpp"

namespace cbcan::scenario {

/// A plant file, as a path from `folder`, for a scenario in any folder; "demo" and nothing stay as they are.
std::string absolute_plant(const std::string& plant_file, const std::string& folder);

/// Steps as text. `begin`: the plant's time that is time 0 of the scenario.
class ScenarioWriter {
 public:
  ScenarioWriter(plant::Control& control, journal::FindName find, Time begin = 0)
      : control_(control), find_(std::move(find)), begin_(begin) {}

  /// `plant`: an absolute path, "demo", or empty for a plant from options alone.
  static std::string opening(const std::string& plant);
  std::string step(Time at, std::string_view keys) const;
  std::string written(Time at, std::size_t network, std::size_t first,
                      std::span<const std::uint16_t> words) const;
  /// The text for a command, a Modbus request that writes, or the end of a transaction; empty for other
  /// events.
  std::string text_of(const journal::Event& event) const;

 private:
  std::string request(const journal::Event& event) const;
  std::string ended(const journal::Event& event) const;
  std::string expected(const journal::Event& ended) const;

  plant::Control& control_;
  journal::FindName find_;
  Time begin_;
};

/// The last minute as a scenario; earlier changes are repeated at its start. It is made in parts, between
/// which the plant may go on.
class LastMinute {
 public:
  LastMinute(plant::Control& control, const journal::FindName& find, std::string plant);
  /// Does one part of the work, which may append something; false = it was the last one.
  bool append(base::Buffer& to);

 private:
  std::string collect();
  std::string text_of(const journal::Event& event);

  plant::Control& control_;
  std::string plant_;
  Time now_;
  Time begin_;
  ScenarioWriter writer_;
  std::uint64_t next_;  ///< event
  std::uint64_t end_;
  std::string before_;
  std::deque<std::string> steps_;
  std::set<std::pair<unsigned, unsigned>> scanned_;  ///< networks and channels
  bool has_begun_ = false;
};

}  // namespace cbcan::scenario

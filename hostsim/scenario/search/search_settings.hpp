// SPDX-License-Identifier: MIT
#pragma once

/// The table [explore] of a plant file or scenario: which faults are tried, and what has to hold.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/setting.hpp"
#include "cbcan/time.hpp"
#include "scenario/scenario.hpp"

namespace cbcan::search {

using scenario::Line;

struct Settings {
  std::string file;           ///< that has the table
  std::vector<Line> faults;   ///< see variants_of(); empty = default_faults()
  std::vector<Line> nodes;    ///< empty = those that the run without faults spoke with
  std::vector<Line> always;   ///< whenever time has passed, and after each Modbus request
  std::vector<Line> done;     ///< at the end, if the command has done its work
  std::vector<Line> gave_up;  ///< at the end, if it gave up knowingly
  std::vector<Line> survive;  ///< after these faults, once, giving up is a failure; empty = default_survive()
  std::vector<Line> reached;  ///< in at least one run
  std::vector<Line> only;     ///< moments at which faults act in every run of this file
  std::vector<Line> advice;   ///< names of advice that does not fail the run without faults, or "ignore"
  std::vector<Line> environment;  ///< names of variables that the command needs
  std::optional<Time> settle;  ///< passes between the end and the last look; none = 5 s
  std::optional<Time> ends;    ///< of a command without an end: it settles, and is ended and done
  std::optional<Time> within;  ///< limit of a run, in the plant's time; none = ten times that without faults
};

/// Stands for all names in Settings::advice.
inline constexpr std::string_view kIgnore = "ignore";

std::vector<std::string> default_faults();
std::vector<std::string> default_survive();

/// The keys, for the page.
extern const std::span<const base::Setting<Settings>> kExploreKeys;

/// The lines under [explore].
std::string text_of(const Settings& settings);

/// Reads the table from the text of a file, which is TOML; without the table everything is as by default.
/// Throws base::UsageError for a mistake in the table.
Settings read_settings(std::string_view text, const std::string& file);

}  // namespace cbcan::search

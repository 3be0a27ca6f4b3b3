// SPDX-License-Identifier: MIT
#pragma once

/// The results that --state keeps, as lines of JSON: for each subject one with its name and a fingerprint of
/// what its results depend on, then one for each run, with its moments and its result. Such texts may be
/// joined. Pure.

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "scenario/search/trial.hpp"

namespace cbcan::search {

struct KeptResults {
  std::string fingerprint;
  std::map<std::string, Result> runs;  ///< by moments
};
using State = std::map<std::string, KeptResults>;  ///< by subject: a scenario, or empty

/// Throws base::UsageError, with `path` and the line, for a text that is none of these, and for results of
/// one subject under two fingerprints.
State parse_state(std::string_view text, const std::string& path);

/// A line of it.
std::string state_line(const std::string& subject, const std::string& fingerprint);
std::string state_line(const std::string& moments, const Result& result);

/// A report, from the process that makes it to the one that wants it; nullopt = the line is not whole.
std::string line_of(const TrialReport& report);
std::optional<TrialReport> report_in(std::string_view line);

}  // namespace cbcan::search

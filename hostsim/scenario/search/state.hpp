// SPDX-License-Identifier: MIT
#pragma once

/// The results that --state keeps, as lines of JSON: for each subject one with its name and a fingerprint of
/// what its results depend on, then one for each run, with its moments and its result. Such texts may be
/// joined, in any order. Pure.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scenario/search/trial.hpp"

namespace cbcan::search {

/// What a result depends on: names and texts, causes before effects.
using Sources = std::vector<std::pair<std::string_view, std::string>>;
/// "version=0.2.0;plant=0123456789abcdef": the first as it is, hashes of the others.
std::string fingerprint_of(const Sources& sources);
/// What results with another fingerprint are of: "version 0.1.0", "another plant".
std::string other_source(std::string_view kept, std::string_view present);

/// A line of a run.
struct KeptRun {
  std::string moments;
  Result result;
  std::optional<Near> near;
};
std::optional<KeptRun> run_in(std::string_view line);

/// Results that stay in their text, as there may be a million.
struct KeptResults {
  bool has(const std::string& moments) const { return !line(moments).empty(); }
  /// The last line of the run; empty = none.
  std::string_view line(const std::string& moments) const;

  std::string fingerprint;
  std::vector<std::pair<std::uint64_t, std::string_view>> lines{};  ///< by hash of the moments
};
using State = std::map<std::string, KeptResults>;  ///< by subject: a scenario, or empty

/// Throws base::UsageError, with `path` and the line, for a text that is none of these, and for results of
/// one subject under two fingerprints. The text outlives the state.
State parse_state(std::string_view text, const std::string& path);

/// A line of it.
std::string state_line(const std::string& subject, const std::string& fingerprint);
std::string state_line(const KeptRun& run);

/// A report, from the process that makes it to the one that wants it; nullopt = the line is not whole.
std::string line_of(const TrialReport& report);
std::optional<TrialReport> report_in(std::string_view line);

}  // namespace cbcan::search

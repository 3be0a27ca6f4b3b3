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

/// Results that are kept, on which a later search goes on.
class Kept {
 public:
  virtual ~Kept() = default;

  /// What follows is about this subject. Throws base::UsageError if there are results of another one with its
  /// name.
  void begin(const std::string& subject, const std::string& fingerprint);
  /// Whether the run was kept before this search.
  bool has(const std::string& moments) const { return known_->has(moments); }
  /// This run; none = it was not kept.
  std::optional<KeptRun> find(const std::string& moments) const;
  /// Throws std::runtime_error.
  virtual void add(const KeptRun& run) = 0;

 protected:
  /// `name` in messages.
  explicit Kept(std::string name) : name_(std::move(name)) {}

  /// Takes what was kept, a text that outlives this. A last line without its end that is no result is one
  /// that a crash of the machine has cut: returns the size without it. Throws base::UsageError for a text
  /// that is none of these.
  std::size_t read(std::string_view text);
  /// The subject's line.
  const std::string& heading() const { return heading_; }

  std::string name_;

 private:
  State state_;
  const KeptResults* known_ = nullptr;
  std::string heading_;
};

/// A report, from the process that makes it to the one that wants it; nullopt = the line is not whole.
std::string line_of(const TrialReport& report);
std::optional<TrialReport> report_in(std::string_view line);

}  // namespace cbcan::search

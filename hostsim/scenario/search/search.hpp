// SPDX-License-Identifier: MIT
#pragma once

/// Which moments are tried, and in which order.

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scenario/search/trial.hpp"

namespace cbcan::search {

/// One list for each variant: a sample of the matching frames that the record counts. Frames at the same
/// place of transactions with the same request and result are a group: the first, the last and halvings
/// between them are tried. In each list every beginning is an even sample.
std::vector<std::vector<Moments>> moments_of(const std::vector<Variant>& variants, const Record& record);

/// The first of each list, then the second of each, and so on.
std::vector<Moments> round_robin(std::vector<std::vector<Moments>> lists);

/// False: no fault has had its moment, so the run has shown nothing.
bool has_happened(const Moments& moments, const Result& result);
inline constexpr std::string_view kNeverHappened = "it never happened, so nothing has been shown";

/// FNV-1a.
std::uint64_t hash_of(std::string_view text);

/// Whether moments are in this one of parts 1..parts; always the same ones, whatever else is tried.
bool is_in_part(const Moments& moments, std::size_t part, std::size_t parts);

/// A failure of several runs: the same condition in the same transaction.
struct Failure {
  Moments moments;  ///< the simplest and earliest
  Result result;
  std::size_t count = 0;
};

/// Sums of the results of runs, added in any order: what a run needs does not grow with their number.
class Results {
 public:
  /// `subject`: the scenario, or empty. `order`: the place of the run among all.
  void add(const std::string& subject, std::size_t order, const Moments& moments, const Result& result);
  /// Kinds and places of the variants without a matching frame.
  void add_unmatched(const Variant& variant);

  /// Failures of a subject, the simplest first.
  std::vector<Failure> failures(const std::string& subject) const;
  /// Kind by place: tried, done, gave up, broken, late.
  std::string table() const;
  /// A test case for each kind and place.
  /// `error` of the machine, which has ended the search; empty = none.
  std::string junit(std::size_t not_tried, const std::string& error) const;
  /// Whether a run of a subject has reached this condition.
  bool reached(const std::string& subject, std::size_t condition) const;
  /// A fault has had its moment.
  bool happened(const std::string& subject) const;
  std::size_t broken() const { return broken_; }

 private:
  struct Subject {
    /// Failures by condition and transaction, with the order of the run that is shown.
    std::map<std::pair<std::string, std::string>, std::pair<Failure, std::size_t>> failures;
    std::vector<bool> reached;
    bool happened = false;
  };
  struct Row {
    std::size_t tried = 0;
    std::array<std::size_t, 4> verdicts{};  ///< by Verdict
    std::size_t not_happened = 0;
    std::map<std::size_t, std::string> broken;  ///< the first ones, by order
  };
  Row& row_of(const Moments& moments);

  std::map<std::string, Subject> subjects_;
  std::map<std::pair<std::string, std::string>, Row> rows_;  ///< by kinds and places
  std::size_t broken_ = 0;
};

}  // namespace cbcan::search

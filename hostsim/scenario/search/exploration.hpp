// SPDX-License-Identifier: MIT
#pragma once

/// A search for the faults that break a program on its plant, or a scenario: from two runs without faults to
/// the moments that are tried.

#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "scenario/search/judge.hpp"
#include "scenario/search/search.hpp"
#include "scenario/search/settings.hpp"

namespace cbcan::search {

/// What is to be run.
struct Run {
  config::Config config;
  std::vector<Variant> counted = {};  ///< their matching frames are recorded
  bool values_may_differ = false;
  bool must_survive = false;
  const Record* undisturbed = nullptr;
};

/// What a run has to say.
struct Told {
  Result result;
  Record record;
  std::string problem;    ///< why it could not be made; empty = it could
  bool is_usage = false;  ///< the problem is the user's, not the machine's
};

/// One with these faults.
Run run_with(const Moments& moments, const config::Config& plant, const Record& undisturbed);

/// Makes runs, some at a time, each from power-on.
class Runner {
 public:
  /// Runs 0..count-1. `ended`, which throws nothing, gets each result, one at a time, in any order; when
  /// `wanted` is false, no further one begins.
  virtual void all(std::size_t count, const std::function<Run(std::size_t)>& make,
                   const std::function<bool()>& wanted,
                   const std::function<void(std::size_t, const Told&)>& ended) = 0;
  Told one(const Run& run);

 protected:
  ~Runner() = default;
};

/// Two faults, and what other pairs have in common with them: the kinds, and the transactions in which they
/// act.
struct Pair {
  std::string alike;
  Moments moments;
};
/// One pair of those that are alike, the earliest, in an order of which every beginning is an even sample.
std::vector<Moments> folded(std::vector<Pair> pairs);

class Exploration {
 public:
  /// `faults` and `nodes`: instead of those in the settings; empty = these. All references outlive it.
  Exploration(const config::Config& plant, const Settings& settings, Runner& runner,
              const std::vector<std::string>& faults, std::vector<std::string> nodes);

  /// Runs twice without faults. Throws base::UsageError if it cannot be explored, std::runtime_error if the
  /// machine prevents it.
  void prepare();
  /// All single faults, in the order in which they are best tried.
  const std::vector<Moments>& moments() const { return moments_; }
  /// Without a matching frame.
  const std::vector<Variant>& never() const { return never_; }
  /// A second fault near the first one, which was alone in the run that made this record.
  std::vector<Pair> pairs(const Moments& first, const Record& record) const;
  /// `counts`: the result is for pairs().
  Run run_of(const Moments& moments, bool counts) const;
  const Record& record() const { return record_; }

 private:
  void count_in(Run& run) const;
  void keep(const Record& counted);

  const config::Config& plant_;
  const Settings& settings_;
  Runner& runner_;
  std::vector<std::string> nodes_;
  std::vector<Variant> variants_;
  std::set<sim::FaultKind> survive_;
  Record record_;
  std::vector<Moments> moments_;
  std::vector<Variant> never_;
};

}  // namespace cbcan::search

// SPDX-License-Identifier: MIT
#pragma once

/// A search for the faults that break a program on its plant, or a scenario: from two runs without faults to
/// the moments that are tried.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "scenario/search/search.hpp"
#include "scenario/search/search_settings.hpp"

namespace cbcan::search {

/// A trial with these faults.
Trial trial_with(const Moments& moments, const config::Config& plant, const Record& baseline);

/// The fault prevents nothing, or not for long.
bool passes(const sim::Fault& fault);

/// Runs trials, some at a time, each from power-on.
class Runner {
 public:
  using Make = std::function<Trial(std::size_t)>;
  using Wanted = std::function<bool()>;
  using Ended = std::function<void(std::size_t, const TrialReport&)>;

  /// Runs trials 0..count-1. `ended`, which throws nothing, gets each report, one at a time, in any order;
  /// when `wanted` is false, no further one begins.
  virtual void run_all(std::size_t count, const Make& make, const Wanted& wanted, const Ended& ended) = 0;
  TrialReport run_one(const Trial& trial);

 protected:
  ~Runner() = default;
};

/// Two faults, and what other pairs of their group have in common with them: the kinds, and the transactions
/// in which they act.
struct Pair {
  std::string group;
  Moments moments;
};
/// The earliest pair of each group.
class Pairs {
 public:
  void add(std::vector<Pair> pairs);
  /// In an order of which every beginning is an even sample.
  std::vector<Moments> take();

 private:
  std::unordered_map<std::uint64_t, Moments> earliest_;  ///< by hash of the group
};

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
  /// Variants without a matching frame.
  const std::vector<Variant>& unmatched() const { return unmatched_; }
  /// What pairs with the first fault need of the record of a run with it alone.
  Near near(const Moments& first, const Record& record) const;
  /// A second fault near the first one; nothing unless the moments are those of this exploration.
  std::vector<Pair> pairs(const Moments& first, const Near& near) const;
  bool knows(const Near& near) const { return near.variants == variants_hash_; }
  /// All moments with the same number, from 0, have the groups of their pairs in common with no others.
  std::size_t number_of(const Moments& moments) const;
  /// `counts`: the result is for pairs().
  Trial trial_of(const Moments& moments, bool counts) const;
  const Record& record() const { return record_; }

 private:
  void count_in(Trial& trial) const;
  void keep(const Record& counted);
  std::size_t own_place(const Moment& moment) const;
  std::string group_of(const Moment& first) const;

  const config::Config& plant_;
  Runner& runner_;
  std::vector<std::string> nodes_;
  std::vector<Variant> variants_;
  std::vector<std::shared_ptr<const Variant>> shared_;  ///< the same
  std::string variants_hash_;
  std::map<std::string, std::size_t> groups_;  ///< numbers of those of the moments
  std::set<sim::FaultKind> survive_;
  Record record_;
  std::vector<Moments> moments_;
  std::vector<Variant> unmatched_;
};

}  // namespace cbcan::search

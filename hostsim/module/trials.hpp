// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "scenario/search/exploration.hpp"
#include "scenario/search/state.hpp"

namespace cbcan::module {

/// Trials that the host makes, some at a time. A search cannot wait for them: it ends, and begins again with
/// what is known of them by then.
class Trials final : public search::Runner {
 public:
  /// Thrown when trials are missing(): the search has to begin again.
  struct Missing {};

  /// A search begins, the same one again. At most `most` trials will be missing.
  void begin(std::size_t most) {
    calls_ = 0;
    most_ = most;
    missing_.clear();
    baseline_.reset();
  }
  /// Another search begins.
  void forget() { known_.clear(); }
  void run_all(std::size_t count, const Make& make, const Wanted& wanted, const Ended& ended) override;

  /// The number of missing trials, which count from 0.
  std::size_t missing() const { return missing_.size(); }
  const search::Trial& trial(std::size_t number) const { return missing_.at(number).trial; }
  void end(std::size_t number, search::TrialReport report) {
    known_[missing_.at(number).place] = std::move(report);
  }

 private:
  using Place = std::pair<std::size_t, std::size_t>;  ///< the call of run_all(), and the trial in it
  struct MissingTrial {
    Place place;
    search::Trial trial;
  };

  std::size_t calls_ = 0;
  std::size_t most_ = 0;
  std::vector<MissingTrial> missing_;
  std::optional<search::Record> baseline_;  ///< of the missing trials
  std::map<Place, search::TrialReport> known_;
};

/// The file of --state, which the host reads and adds to.
class KeptText final : public search::Kept {
 public:
  explicit KeptText(const std::string& path) : Kept("--state " + path) {}

  /// Takes the file, and returns how much of it is to be left. Throws base::UsageError.
  std::size_t take(std::string text) {
    text_ = std::move(text);
    const std::size_t size = read(text_);
    if (size == text_.size() && !text_.empty() && text_.back() != '\n') unsaved_ = "\n";
    return size;
  }
  void add(const search::KeptRun& run) override {
    if (!added_.insert(heading() + run.moments).second) return;
    const bool is_below = !unsaved_.empty() && below_ == heading();
    unsaved_ += (is_below ? "" : below_ = heading()) + search::state_line(run);
  }
  /// What is to be added.
  std::string take_unsaved() { return std::exchange(unsaved_, {}); }

 private:
  std::string text_;
  std::set<std::string> added_;
  std::string unsaved_;
  std::string below_;  ///< the heading of its last line
};

}  // namespace cbcan::module

// SPDX-License-Identifier: MIT
#pragma once

/// Watches a plant while a PLC's program, or a scenario, runs on it with faults, and says whether what
/// happened may happen: the conditions of [explore], and the rules.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scenario/search/rules.hpp"

namespace cbcan::search {

class Judge final : private JudgedRun, private plant::Listener {
 public:
  /// Make it before the plant starts. `pass` lets time pass in the plant, and calls keep_up() after each
  /// step; all of it outlives the judge. Throws base::UsageError, with file and line, for a condition.
  Judge(plant::Control& control, const Settings& settings, const Trial& trial,
        std::function<void(Time)> pass);

  /// Time has passed while the plant settles: reads the journal before it wraps.
  void keep_up() {
    if (is_settling_ && cursor_.unread() > kEvents / 2) read_journal();
  }
  /// Time has passed, or a request has been answered. False: the run ends.
  bool look();
  /// A scenario has failed: a report of lines.
  void fail(const std::string& report) { broken("the scenario passes", report); }
  /// The program has ended, with this code, or has been ended; nullopt = a scenario.
  TrialReport end(std::optional<int> exit_code);

 private:
  struct Held {
    std::unique_ptr<plant::Condition> condition;
    std::string text;
  };
  struct Counter {
    const sim::FaultSet* set;
    unsigned number;
  };

  Time settle_time() const { return settings.settle.value_or(kSettle); }
  /// The program is to be ended: it has settled.
  bool is_over() const { return settings.ends && control.now() >= *settings.ends + settle_time(); }
  /// Matching frames, up to now, are moments.
  bool counts() const {
    return !trial.counted.empty() && !has_ended && control.now() < settings.ends.value_or(kNever);
  }
  /// There is something to be seen in that time.
  bool settles() const {
    return settings.settle || is_open() || !always_.empty() || !done_.empty() || !gave_up_.empty() ||
           !reached_.empty();
  }
  void settle();
  std::vector<Held> conditions(std::string_view key, const std::vector<Line>& lines);
  void on_frame(std::size_t network, const Frame& frame, Time now) override;
  void read_journal();
  void follow(const journal::Event& event);
  void on_advice(const journal::Event& advice);
  void check(const std::vector<Held>& held, std::string_view name);
  void find_counters();
  std::vector<std::uint32_t> matches() const;

  std::vector<std::unique_ptr<Rule>> rules_ = make_rules();
  journal::Cursor cursor_;
  std::vector<Held> always_;
  std::vector<Held> done_;
  std::vector<Held> gave_up_;
  std::vector<Held> reached_;
  std::vector<Counter> counters_;  ///< by counted variant; number 0 = it has none
  bool is_settling_ = false;
  std::uint64_t requests_at_fault_ = ~std::uint64_t{0};
};

}  // namespace cbcan::search

// SPDX-License-Identifier: MIT
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "config/build_node.hpp"
#include "module/instance.hpp"
#include "scenario/search/campaign.hpp"
#include "scenario/search/exploration.hpp"
#include "scenario/search/judge.hpp"
#include "scenario/search/scenario_run.hpp"
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
  void run_all(std::size_t count, const Make& make, const Wanted& wanted, const Ended& ended) override {
    const std::size_t call = calls_++;
    for (std::size_t i = 0; i < count; ++i) {
      if (const auto known = known_.find({call, i}); known != known_.end()) {
        ended(i, known->second);
      } else if (missing_.size() < most_ && wanted()) {
        search::Trial& trial = missing_.emplace_back(Place(call, i), make(i)).trial;
        if (trial.baseline == nullptr) continue;
        if (!baseline_) baseline_ = *trial.baseline;
        trial.baseline = &*baseline_;
      }
    }
    if (!missing_.empty()) throw Missing();
  }

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

/// A search, and what of it is kept from one call to the next.
struct Instance::Searching {
  Searching(const config::SearchConfig& options, Instance& instance)
      : options(options), kept(options.state), campaign(make_campaign(options, instance, kept)) {}

  const config::SearchConfig& options;
  KeptText kept;
  Trials trials;
  std::unique_ptr<search::Campaign> campaign;
  search::Settings explored;                ///< of a command
  std::vector<search::Explored> scenarios;  ///< none = a command is searched
  std::size_t place = 0;                    ///< of the scenario
};

/// After this everything that the trials need has been read.
Json Instance::begin_search(const config::SearchConfig& options) {
  searching_ = std::make_shared<Searching>(options, *this);
  const std::string state = options.state.empty() ? "" : read_(options.state).value_or("");
  const std::size_t kept = searching_->kept.take(state);
  return {{"search",
           {{"state", options.state},
            {"cut_to", kept == state.size() ? Json() : Json(kept)},
            {"out", options.out},
            {"junit", options.junit},
            {"jobs", options.jobs},
            {"budget", base::parse_duration(options.budget).value_or(kNever)}}}};
}

Json Instance::search_command(search::Settings explored) {
  Json begun = begin_search(start_.search);
  begun["command"] = true;
  searching_->explored = std::move(explored);
  return begun;
}

Json Instance::search_scenarios() {
  Json begun = begin_search(run_);
  for (const std::string& path : scenarios_) {
    searching_->scenarios.push_back(search::read_explored(path, run_.only, read_));
    config::build_nodes(searching_->scenarios.back().scenario.config, eds_files_);
  }
  return begun;
}

Json Instance::search(Time passed, std::size_t most) {
  searched_ = passed;
  Json result{{"trials", 0}};
  try {
    result["exit"] = static_cast<int>(go_on(most));
    result["junit"] = searching_->campaign->junit();
  } catch (const Trials::Missing&) {
    told_ = Json::array();  // it will be reported again
    result["trials"] = searching_->trials.missing();
  } catch (const std::exception& error) {
    const bool is_usage = dynamic_cast<const base::UsageError*>(&error) != nullptr;
    tell(message(error.what()));
    result["exit"] = static_cast<int>(is_usage ? base::ExitCode::kUsage : base::ExitCode::kEnvironment);
  }
  result["progress"] = progress_;
  result["kept"] = searching_->kept.take_unsaved();
  return result;
}

base::ExitCode Instance::go_on(std::size_t most) {
  Searching& all = *searching_;
  if (!all.options.explore) {
    all.trials.begin(most);
    return search::run_seeds(start_, all.trials, *this);
  }
  for (; all.place < std::max<std::size_t>(all.scenarios.size(), 1); ++all.place, all.trials.forget()) {
    all.trials.begin(most);
    std::unique_ptr<search::Campaign> campaign = all.campaign->copy();
    campaign->run(all.scenarios.empty()
                      ? subject_of(start_, all.explored, all.trials, *this)
                      : subject_of(all.scenarios[all.place], run_, eds_files_, all.trials, *this));
    all.campaign = std::move(campaign);
  }
  return all.campaign->report();
}

// ---- Trials

void Instance::try_here(std::size_t number) {
  Searching& all = *searching_;
  const search::Explored& file = all.scenarios[all.place];
  all.trials.end(number,
                 search::play_or_problem(file.scenario, all.trials.trial(number), file.settings, eds_files_));
}

Json Instance::begin_trial(Instance& search, std::size_t number) try {
  searching_ = search.searching_;
  trial_ = number;
  const search::Trial& trial = searching_->trials.trial(number);
  start_.config = trial.config;
  config::PlantBuild build = config::build_nodes(start_.config, search.eds_files_);
  leave_files_alone(build.read);
  open(std::move(build), search.plant_file_);
  judge_ = std::make_unique<search::Judge>(session_->control(), searching_->explored, trial,
                                           [this](Time duration) { let_pass(duration); });
  session_->watch([this] {
    if (!judge_->look()) stop();
  });
  return {{"services", services()}, {"links", Json::array()}, {"command", search.start_.command}};
} catch (const base::UsageError& mistake) {
  searching_->trials.end(number, {.problem = mistake.what(), .is_usage = true});
  return ended(base::ExitCode::kUsage);
}

void Instance::end_trial(int code, std::string_view said) {
  session_->watch([this] { judge_->keep_up(); });
  search::TrialReport report = judge_->end(code);
  report.result.said = search::indented(said);
  searching_->trials.end(trial_, std::move(report));
}

void Instance::hang(std::size_t number, Time limit, std::string_view said) {
  search::TrialReport report = search::hanging(limit);
  report.result.said = search::indented(said);
  searching_->trials.end(number, std::move(report));
}

}  // namespace cbcan::module

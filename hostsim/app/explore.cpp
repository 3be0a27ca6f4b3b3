// SPDX-License-Identifier: MIT
#include "app/explore.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iterator>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "app/parallel.hpp"
#include "app/processes.hpp"
#include "app/progress.hpp"
#include "app/state_file.hpp"
#include "base/text.hpp"
#include "cbcan/version.hpp"
#include "config/plant_file.hpp"
#include "io/loop/lines.hpp"
#include "io/loop/reactor.hpp"
#include "scenario/outcome.hpp"
#include "scenario/search/exploration.hpp"
#include "scenario/search/scenario_run.hpp"

namespace cbcan::app {

namespace {

using config::kDemo;
using search::Moments;
using search::Record;
using search::Result;
using search::Trial;
using search::TrialReport;

/// Plays a scenario, each time on a plant of its own.
class Threads final : public search::Runner {
 public:
  /// Starts a thread for each of `files`.
  Threads(const scenario::Scenario& scenario, std::span<config::EdsFiles> files,
          const search::Settings& settings)
      : scenario_(scenario), files_(files), settings_(settings) {}

  void run_all(std::size_t count, const Make& make, const Wanted& wanted, const Ended& ended) override {
    std::mutex one;
    in_parallel(count, files_.size(), [&](std::size_t i, std::size_t thread) {
      if (!wanted()) return;
      TrialReport report;
      try {
        report = search::play(scenario_, make(i), settings_, files_[thread]);
      } catch (const std::exception& error) {
        report.problem = error.what();
        report.is_usage = true;  // the plant is in memory
      }
      const std::scoped_lock lock(one);
      ended(i, report);
    });
  }

 private:
  const scenario::Scenario& scenario_;
  std::span<config::EdsFiles> files_;
  const search::Settings& settings_;
};

std::vector<std::string> words_in(const std::string& list) {
  return base::column(base::words_of(list, ","), [](auto word) { return std::string(base::trim(word)); });
}

/// A file name from a moment.
std::string file_name_of(const Moments& moments) {
  std::string name = to_string(moments);
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '-';
  return name + ".toml";
}

/// The same condition, with the faults of the other failure and perhaps more, or with faults that stay and
/// only begin later.
bool is_repeat(const search::Failure& failure, const search::Failure& other) {
  const auto is_in_failure = [&failure](const search::Moment& moment) {
    return std::ranges::any_of(failure.moments, [&](const search::Moment& later) {
      return later == moment ||
             (later.variant() == moment.variant() && !search::passes(moment.variant().fault));
    });
  };
  return other.result.what == failure.result.what && std::ranges::all_of(other.moments, is_in_failure);
}

/// What is searched: a command, or a scenario.
struct Subject {
  std::string name;      ///< of a scenario; empty for a command
  search::Sources sources;  ///< of the results, apart from what the run without faults shows
  const config::Config& plant;
  const search::Settings& settings;
  Moments only;  ///< the one run to make; empty = all
  search::Runner& runner;
  std::function<std::string(const search::Failure&)> write;  ///< returns the file that plays the failure
};

/// The search for failures of any number of subjects.
class Search {
 public:
  /// Throws io::UsageError, io::EnvironmentError for a file or folder of the options.
  Search(const config::SearchConfig& search, Console& console)
      : search_(search), console_(console), state_(search.state) {
    if (!search.out.empty()) io::make_folder("--out", search.out);
    if (!search.junit.empty()) junit_.emplace("--junit", search.junit);
  }

  /// Nothing after an error.
  void run(const Subject& subject) {
    if (!error_.empty()) return;
    try {
      search(subject);
    } catch (const std::exception& error) {
      const bool is_usage = dynamic_cast<const base::UsageError*>(&error) != nullptr;
      exit_code_ = is_usage ? base::ExitCode::kUsage : base::ExitCode::kEnvironment;
      error_ = base::trim(error.what());
      if (!error_.starts_with(subject.name)) error_.insert(0, prefix(subject));
    }
  }

  base::ExitCode report() {
    progress_.show("");
    if (offered_ == 0 && error_.empty()) {
      error_ = "without faults, no frame matches one of these, so nothing can be tried";
      exit_code_ = base::ExitCode::kUsage;
    }
    if (!error_.empty()) console_.tell(fmt::format("cbcan-sim: {}\n", error_));
    if (!search_.list && (error_.empty() || tried_ != 0))
      console_.say(fmt::format("{}{}\nruns: {}, broken: {}, distinct failures: {}{}\n", results_.table(),
                               failures_, tried_, results_.broken(), distinct_,
                               left_ != 0 ? fmt::format(", not tried: {}", left_) : ""));
    if (junit_) junit_->write(results_.junit(left_, error_));
    return error_.empty() && distinct_ != 0 ? base::ExitCode::kCheckFailed : exit_code_;
  }

 private:
  static std::string prefix(const Subject& subject) {
    return subject.name.empty() ? "" : subject.name + ": ";
  }

  /// Throws base::UsageError, or another exception for what the machine prevents.
  void search(const Subject& subject) {
    std::vector<std::string> faults = words_in(search_.faults);
    if (faults.empty() && subject.settings.faults.empty() && !subject.name.empty()) {
      faults = search::default_faults();
      std::erase(faults, search::kTypical);  // a scenario knows its times
    }
    search::Exploration exploration(subject.plant, subject.settings, subject.runner, faults,
                                    words_in(search_.nodes));
    exploration.prepare();
    if (subject.name.empty() && exploration.record().requests == 0)
      throw base::UsageError("the command has sent no Modbus request, so no fault can break it");
    std::vector<Moments> moments =
        subject.only.empty() ? exploration.moments() : std::vector<Moments>(1, subject.only);
    offered_ += moments.size();
    state_.begin(subject.name, fingerprint(subject, exploration.record()));
    std::size_t others = leave_out_others(exploration, moments);
    if (search_.list) {
      for (const Moments& each : moments)
        console_.say(to_string(each) + "\n");
      return;
    }
    for (const search::Variant& variant : exploration.unmatched())
      results_.add_unmatched(variant);
    search::Pairs pairs;
    try_all(subject, exploration, moments, is_in_pairs() ? &pairs : nullptr);
    if (is_in_pairs()) {
      moments = pairs.take();
      others += leave_out_others(exploration, moments);
      try_all(subject, exploration, moments, nullptr);
    }
    add_failures(subject, exploration);
    if (left_ == 0 && others == 0) check_shown(subject);
  }

  void add_failures(const Subject& subject, const search::Exploration& exploration) {
    for (const search::Failure& failure : shrunk(subject, exploration)) {
      std::string more = failure.count > 1 ? fmt::format("  and {} more like it\n", failure.count - 1) : "";
      if (!search_.out.empty()) more += fmt::format("  replay: {}\n", subject.write(failure));
      add_failure(subject, to_string(failure.moments) + "\n  " + search::report(failure.result) + more);
    }
  }

  void add_failure(const Subject& subject, const std::string& text) {
    failures_ += fmt::format("\n{}{}", prefix(subject), text);
    ++distinct_;
  }

  /// What no run has shown, when all have been made.
  void check_shown(const Subject& subject) {
    if (!subject.only.empty() && !results_.happened(subject.name))
      add_failure(subject, fmt::format("{}: {}\n", to_string(subject.only), search::kNeverHappened));
    for (std::size_t i = 0; i < subject.settings.reached.size(); ++i)
      if (!results_.reached(subject.name, i))
        add_failure(subject, fmt::format("reached {}: in no run, so nothing has been shown about it\n",
                                         subject.settings.reached[i].text));
  }

  /// The failures with faults as early as possible; those that become the same are one.
  std::vector<search::Failure> shrunk(const Subject& subject, const search::Exploration& exploration) {
    std::vector<search::Failure> distinct;
    const auto is_known = [&distinct](const search::Failure& failure) {
      const auto known = std::ranges::find_if(
          distinct, [&failure](const search::Failure& other) { return is_repeat(failure, other); });
      if (known != distinct.end()) known->count += failure.count;
      return known != distinct.end();
    };
    for (search::Failure& failure : results_.failures(subject.name)) {
      if (is_known(failure)) continue;
      search::Failure simple = search::earlier(exploration, subject.runner, std::move(failure));
      if (!is_known(simple)) distinct.push_back(std::move(simple));
    }
    return distinct;
  }

  bool is_in_pairs() const { return search_.together == 2; }

  /// Removes those of other parts, unless --state has their results. Returns their number. A pair is of the
  /// part that makes the run with its first fault alone, so each of these is made once.
  std::size_t leave_out_others(const search::Exploration& exploration, std::vector<Moments>& moments) const {
    return std::erase_if(moments, [&](const Moments& each) {
      const bool is_ours = is_in_pairs() ? exploration.number_of(each) % shard_.parts == shard_.part - 1
                                         : search::is_in_part(each, shard_.part, shard_.parts);
      return !is_ours && !state_.has(to_string(each));
    });
  }

  /// Tries all moments. `pairs` gets those with each of them.
  void try_all(const Subject& subject, const search::Exploration& exploration,
               const std::vector<Moments>& moments, search::Pairs* pairs) {
    std::vector<std::size_t> left;
    const std::size_t first_order = std::exchange(next_order_, next_order_ + moments.size());
    for (std::size_t i = 0; i < moments.size(); ++i) {
      const auto known = state_.find(to_string(moments[i]));
      const bool suffices = known && (pairs == nullptr || (known->near && exploration.knows(*known->near)));
      if (!suffices) {
        left.push_back(i);
        continue;
      }
      if (pairs != nullptr) pairs->add(exploration.pairs(moments[i], *known->near));
      add(subject, first_order + i, moments[i], known->result);
    }
    left_ += left.size();
    std::atomic<bool> good = true;
    std::string problem;
    subject.runner.run_all(
        left.size(), [&](std::size_t i) { return exploration.trial_of(moments[left[i]], pairs != nullptr); },
        [&] { return good && io::Reactor::now() - begun_ < budget_; },
        [&](std::size_t i, const TrialReport& report) {
          const Moments& tried = moments[left[i]];
          if (!report.problem.empty()) {
            problem = fmt::format("{}: {}", to_string(tried), report.problem);
            good = false;
          }
          if (!good) return;
          --left_;
          search::KeptRun run{to_string(tried), report.result, {}};
          if (pairs != nullptr) {
            run.near = exploration.near(tried, report.record);
            pairs->add(exploration.pairs(tried, *run.near));
          }
          add(subject, first_order + left[i], tried, report.result);
          try {
            state_.add(run);
          } catch (const io::EnvironmentError& error) {
            problem = error.what();
            good = false;
          }
        });
    if (!good) throw io::EnvironmentError(problem);
  }

  void add(const Subject& subject, std::size_t order, const Moments& moments, const Result& result) {
    results_.add(subject.name, order, moments, result);
    ++tried_;
    progress_.show(fmt::format("{} runs, {} broken, {} left", tried_, results_.broken(), left_));
  }

  static std::string fingerprint(const Subject& subject, const Record& record) {
    search::Sources sources = subject.sources;
    sources.emplace(sources.begin(), "version", kVersion);
    std::string frames;
    for (const std::string& frame : record.frames)
      frames += frame + '\n';
    sources.emplace_back("run without faults", frames);
    return search::fingerprint_of(sources);
  }

  const config::SearchConfig& search_;
  Console& console_;
  StateFile state_;
  std::optional<io::ResultFile> junit_;
  const config::Shard shard_ = config::shard_of(search_.shard);
  const Time begun_ = io::Reactor::now();
  const Time budget_ = base::parse_duration(search_.budget).value_or(kNever);
  Progress progress_;
  search::Results results_;
  std::size_t offered_ = 0;     ///< moments of all parts
  std::size_t next_order_ = 0;  ///< of the next moment in the results
  std::size_t tried_ = 0;
  std::size_t left_ = 0;
  std::size_t distinct_ = 0;
  std::string failures_;  ///< as text
  std::string error_;     ///< which has ended the search
  base::ExitCode exit_code_ = base::ExitCode::kDone;
};

/// A file that adds the faults to the plant or scenario of another one: the demo, or a path. Returns its
/// name.
std::string write_file(const std::string& path, std::string plant, const std::string& command,
                       search::Settings settings, const search::Failure& failure, const std::string& steps) {
  const auto whole = [](const std::string& name) {
    return std::filesystem::absolute(name.empty() ? "." : name).lexically_normal();
  };
  const std::string folder = std::filesystem::path(path).parent_path();
  if (plant != kDemo) plant = whole(plant).lexically_relative(whole(folder));
  settings.only = {{to_string(failure.moments)}};
  io::ResultFile("--out", path)
      .write(fmt::format("# {}: {}\n# {}\nplant = {}\n\n[explore]\n{}{}", base::to_utf8(failure.result.what),
                         base::to_utf8(failure.result.seen.substr(0, failure.result.seen.find('\n'))),
                         base::to_utf8(command), base::toml_text(plant), text_of(settings), steps));
  return path;
}

/// "NAME=VALUE " for each variable that is set.
std::string environment_of(const search::Settings& settings) {
  std::vector<std::string> names = base::column(settings.environment, &search::Line::text);
  names.emplace_back("PYTHONPATH");
  std::string text;
  for (const std::string& name : names)
    if (const char* const value = std::getenv(name.c_str())) text += fmt::format("{}={} ", name, value);
  return text;
}

std::string write_plant_file(const config::Start& start, const search::Settings& settings,
                             const search::Failure& failure) {
  const std::string path = std::filesystem::path(start.search.out) / file_name_of(failure.moments);
  return write_file(path, start.plant_file.empty() ? std::string(kDemo) : start.plant_file,
                    fmt::format("{}cbcan-sim --config {} --explore -- {}", environment_of(settings), path,
                                fmt::join(start.command, " ")),
                    settings, failure, "");
}

/// Writes a scenario with as few steps as possible.
std::string write_scenario(const scenario::Scenario& scenario, const search::Settings& settings,
                           const config::SearchConfig& search, config::EdsFiles& files,
                           const search::Failure& failure) {
  const search::ShrunkScenario shrunk = search::with_fewer_steps(scenario, failure, settings, files);
  const std::string path =
      std::filesystem::path(search.out) /
      (std::filesystem::path(scenario.file).stem().string() + "-" + file_name_of(shrunk.failure.moments));
  std::string steps;
  for (const scenario::Step& step : shrunk.scenario.steps)
    steps += "\n[[step]]\n" + text_of(step);
  return write_file(path, scenario.file, "cbcan-sim run " + path, settings, shrunk.failure, steps);
}

/// Runs with each seed. Gave up = failed: nothing has disturbed it.
int run_seeds(const config::Start& start, config::EdsFiles& files, const search::Settings& settings,
              Console& console) {
  const config::Seeds seeds = config::seeds_of(start.search.seeds);
  const Record nothing_known;
  Processes runs(start, files, settings);
  scenario::SeedOutcomes outcomes;
  const std::size_t count = std::size_t{seeds.last} - seeds.first + 1;
  runs.run_all(
      count,
      [&](std::size_t i) {
        Trial trial{.config = start.config, .baseline = &nothing_known};
        trial.config.seed = static_cast<std::uint32_t>(seeds.first + i);
        return trial;
      },
      [] { return true; },
      [&](std::size_t i, const TrialReport& report) {
        if (report.is_usage) throw io::UsageError(report.problem);
        if (!report.problem.empty()) throw io::EnvironmentError(report.problem);
        const bool good = report.result.verdict == search::Verdict::kDone;
        outcomes.add(static_cast<std::uint32_t>(seeds.first + i),
                     {good ? scenario::Verdict::kPassed : scenario::Verdict::kFailed, report.result.duration,
                      good ? "" : search::report(report.result)});
      });
  const scenario::Outcome all =
      outcomes.sum("cbcan-sim ...", fmt::format("-- {}", fmt::join(start.command, " ")));
  console.say(scenario::report(start.command.front(), all));
  return static_cast<int>(all.verdict == scenario::Verdict::kPassed ? base::ExitCode::kDone
                                                                    : base::ExitCode::kCheckFailed);
}

}  // namespace

std::size_t at_a_time(const config::SearchConfig& search) {
  return search.jobs != 0 ? search.jobs : std::max(1U, std::thread::hardware_concurrency());
}

int run_many(const config::Start& start, const search::Settings& settings, config::EdsFiles& files,
             Console& console) {
  if (!start.search.explore) return run_seeds(start, files, settings, console);
  Processes runner(start, files, settings);
  Search search(start.search, console);
  config::Config plant = start.config;
  const search::Sources sources{{"plant", start.plant_text},
                                {"option", fmt::format("{}", fmt::join(start.words, " "))},
                                {"command", fmt::format("{}", fmt::join(start.command, " "))}};
  search.run({"", sources, start.config, settings, search::only(start.search.only, settings, plant), runner,
              [&](const search::Failure& failure) { return write_plant_file(start, settings, failure); }});
  return static_cast<int>(search.report());
}

base::ExitCode explore_scenarios(const std::vector<std::string>& paths, const config::SearchConfig& search,
                                 const base::FileReader& read, Console& console) {
  std::vector<config::EdsFiles> files(at_a_time(search), config::EdsFiles(read));
  struct File {
    scenario::Scenario scenario;
    search::Settings settings;
    Moments only;
  };
  std::vector<File> all_files;
  for (const std::string& path : paths) {
    File& file = all_files.emplace_back();
    file.scenario = scenario::read_scenario(read(path).value_or(""), path, read);
    if (!file.scenario.problems.empty()) throw io::UsageError(to_string(file.scenario.problems.front()));
    file.settings = search::read_settings(file.scenario.text, path);
    file.only = search::only(search.only, file.settings, file.scenario.config);
  }
  Search all(search, console);
  for (const File& file : all_files) {
    const scenario::Scenario& scenario = file.scenario;
    Threads runner(scenario, files, file.settings);
    all.run({scenario.file,
             {{"scenario", scenario.text}},
             scenario.config,
             file.settings,
             file.only,
             runner,
             [&](const search::Failure& failure) {
               return write_scenario(scenario, file.settings, search, files.front(), failure);
             }});
  }
  return all.report();
}

}  // namespace cbcan::app

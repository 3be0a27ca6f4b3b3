// SPDX-License-Identifier: MIT
#include "app/explore.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "app/parallel.hpp"
#include "app/processes.hpp"
#include "app/progress.hpp"
#include "app/result_file.hpp"
#include "app/simulator.hpp"
#include "app/state_file.hpp"
#include "cbcan/version.hpp"
#include "explore/exploration.hpp"
#include "explore/scenario_run.hpp"
#include "explore/shrink.hpp"
#include "files/read_file.hpp"
#include "io/loop/output.hpp"
#include "scenario/outcome.hpp"
#include "scenario/scenario_writer.hpp"
#include "text/numbers.hpp"
#include "text/utf8.hpp"
#include "text/words.hpp"

namespace cbcan::app {

namespace {

using explore::Moments;
using explore::Record;
using explore::Result;
using explore::Run;
using explore::Told;

/// Plays a scenario, each time on a plant of its own.
class Threads final : public explore::Runner {
 public:
  /// With one of `files` for each thread.
  Threads(const scenario::Scenario& scenario, std::span<config::EdsFiles> files,
          const explore::Settings& settings)
      : scenario_(scenario), files_(files), settings_(settings) {}

  void all(std::size_t count, const std::function<Run(std::size_t)>& make,
           const std::function<bool()>& wanted,
           const std::function<void(std::size_t, const Told&)>& ended) override {
    std::mutex one;
    in_parallel(count, files_.size(), [&](std::size_t i, std::size_t thread) {
      if (!wanted()) return;
      Told told;
      try {
        told = explore::play(scenario_, make(i), settings_, files_[thread]);
      } catch (const std::exception& error) {
        told.problem = error.what();
        told.is_usage = true;  // the plant is in memory
      }
      const std::scoped_lock lock(one);
      ended(i, told);
    });
  }

 private:
  const scenario::Scenario& scenario_;
  std::span<config::EdsFiles> files_;
  const explore::Settings& settings_;
};

std::vector<std::string> words_in(const std::string& list) {
  std::vector<std::string> words;
  for (std::string_view rest = list; !rest.empty();)
    words.emplace_back(text::trim(text::take_part(rest, ',')));
  return words;
}

/// A file name from a moment.
std::string file_name_of(const Moments& moments) {
  std::string name = to_string(moments);
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '-';
  return name + ".toml";
}

/// What is searched: a command, or a scenario.
struct Subject {
  std::string name;      ///< of a scenario; empty for a command
  std::string identity;  ///< whatever decides the results, apart from what the undisturbed run shows
  const config::Config& plant;
  const explore::Settings& settings;
  Moments only;  ///< the one run to make; empty = all
  explore::Runner& runner;
  std::function<std::string(const explore::Failure&)> write;  ///< returns the file that plays the failure
};

/// Of any number of subjects.
class Search {
 public:
  /// Throws io::UsageError, io::EnvironmentError for a file or folder of the options.
  Search(const cli::SearchConfig& search, Console& console)
      : search_(search), console_(console), state_(search.state) {
    if (!search.out.empty()) need_folder("--out", search.out);
    if (!search.junit.empty()) junit_.emplace("--junit", search.junit);
  }

  /// Nothing after an error.
  void run(const Subject& subject) {
    if (!error_.empty()) return;
    try {
      search(subject);
    } catch (const std::exception& error) {
      const bool is_usage = dynamic_cast<const text::UsageError*>(&error) != nullptr;
      exit_code_ = is_usage ? options::ExitCode::kUsage : options::ExitCode::kEnvironment;
      error_ = fmt::format("{}{}", prefix(subject), text::trim(error.what()));
    }
  }

  options::ExitCode report() {
    progress_.show("");
    if (offered_ == 0 && error_.empty()) {
      error_ = "without faults, no frame matches one of these, so nothing can be tried";
      exit_code_ = options::ExitCode::kUsage;
    }
    if (!error_.empty()) console_.tell(fmt::format("cbcan-sim: {}\n", error_));
    if (junit_) junit_->write(results_.junit(left_, error_));
    if (search_.list || (!error_.empty() && tried_ == 0)) return exit_code_;
    console_.say(results_.table() + failures_);
    console_.say(fmt::format("\nruns: {}, broken: {}, distinct failures: {}{}\n", tried_, results_.broken(),
                             distinct_, left_ != 0 ? fmt::format(", not tried: {}", left_) : ""));
    if (!error_.empty()) return exit_code_;
    return distinct_ == 0 ? options::ExitCode::kDone : options::ExitCode::kCheckFailed;
  }

 private:
  static std::string prefix(const Subject& subject) {
    return subject.name.empty() ? "" : subject.name + ": ";
  }

  /// Throws text::UsageError, or another exception for what the machine prevents.
  void search(const Subject& subject) {
    explore::Exploration exploration(subject.plant, subject.settings, subject.runner,
                                     words_in(search_.faults), words_in(search_.nodes));
    exploration.prepare();
    std::vector<Moments> moments =
        subject.only.empty() ? exploration.moments() : std::vector<Moments>(1, subject.only);
    if (subject.name.empty() && exploration.record().requests == 0)
      throw text::UsageError("the command has sent no Modbus request, so no fault can break it");
    offered_ += moments.size();
    state_.begin(subject.name, fingerprint(subject, exploration.record()));
    const bool with_pairs = search_.together == 2;
    std::size_t others = with_pairs ? 0 : leave_out_others(moments);
    if (search_.list) {
      for (const Moments& each : moments)
        console_.say(to_string(each) + "\n");
      return;
    }
    for (const explore::Variant& variant : exploration.never())
      results_.add_never(variant);
    std::vector<explore::Pair> pairs;
    const OnRecord add_pairs = [&](const Moments& first, const Record& record) {
      std::ranges::move(exploration.pairs(first, record), std::back_inserter(pairs));
    };
    try_all(subject, exploration, moments, with_pairs ? add_pairs : OnRecord());
    std::vector<Moments> folded = explore::folded(std::move(pairs));
    others += leave_out_others(folded);
    try_all(subject, exploration, folded, {});
    for (const explore::Failure& failure : shrunk(subject, exploration)) {
      std::string more = failure.count > 1 ? fmt::format("  and {} more like it\n", failure.count - 1) : "";
      if (!search_.out.empty()) more += fmt::format("  replay: {}\n", subject.write(failure));
      add_failure(subject, to_string(failure.moments) + "\n  " + explore::report(failure.result) + more);
    }
    if (left_ == 0 && others == 0) check_shown(subject);
  }

  void add_failure(const Subject& subject, const std::string& text) {
    failures_ += fmt::format("\n{}{}", prefix(subject), text);
    ++distinct_;
  }

  /// What no run has shown, when all have been made.
  void check_shown(const Subject& subject) {
    if (!subject.only.empty() && !results_.happened(subject.name))
      add_failure(subject, fmt::format("{}: {}\n", to_string(subject.only), explore::kNeverHappened));
    for (std::size_t i = 0; i < subject.settings.reached.size(); ++i)
      if (!results_.reached(subject.name, i))
        add_failure(subject, fmt::format("reached {}: in no run, so nothing has been shown about it\n",
                                         subject.settings.reached[i].text));
  }

  /// The failures with faults as early as possible; those that become the same, or have the faults of another
  /// one and more, are one.
  std::vector<explore::Failure> shrunk(const Subject& subject, const explore::Exploration& exploration) {
    std::vector<explore::Failure> distinct;
    for (explore::Failure& failure : results_.failures(subject.name)) {
      explore::Failure simple = explore::earlier(exploration, subject.runner, std::move(failure));
      const auto same = std::ranges::find_if(distinct, [&](const explore::Failure& other) {
        const auto is_in_simple = [&](const explore::Moment& moment) {
          return std::ranges::find(simple.moments, moment) != simple.moments.end();
        };
        return other.result.what == simple.result.what && std::ranges::all_of(other.moments, is_in_simple);
      });
      if (same == distinct.end())
        distinct.push_back(std::move(simple));
      else
        same->count += simple.count;
    }
    return distinct;
  }

  /// Removes those of other parts, unless --state has their results. Returns their number.
  std::size_t leave_out_others(std::vector<Moments>& moments) const {
    return std::erase_if(moments, [this](const Moments& each) { return !is_ours(each); });
  }

  bool is_ours(const Moments& moments) const {
    return explore::is_in_part(moments, shard_.part, shard_.parts) ||
           state_.find(to_string(moments)) != nullptr;
  }

  using OnRecord = std::function<void(const Moments&, const Record&)>;

  /// With `on_record`, matching frames are counted in each run, and results of others do not replace it.
  void try_all(const Subject& subject, const explore::Exploration& exploration,
               const std::vector<Moments>& moments, const OnRecord& on_record) {
    std::vector<std::size_t> left;
    const std::size_t first_order = tried_ + left_;
    for (std::size_t i = 0; i < moments.size(); ++i) {
      const Result* const known = on_record ? nullptr : state_.find(to_string(moments[i]));
      known != nullptr ? add(subject, first_order + i, moments[i], *known) : left.push_back(i);
    }
    left_ += left.size();
    std::atomic<bool> good = true;
    std::string problem;
    subject.runner.all(
        left.size(),
        [&](std::size_t i) { return exploration.run_of(moments[left[i]], static_cast<bool>(on_record)); },
        [&] { return good && io::Reactor::now() - begun_ < budget_; },
        [&](std::size_t i, const Told& told) {
          const Moments& tried = moments[left[i]];
          if (!told.problem.empty()) {
            problem = fmt::format("{}: {}", to_string(tried), told.problem);
            good = false;
          }
          if (!good) return;
          --left_;
          if (on_record) on_record(tried, told.record);
          if (on_record && !is_ours(tried)) return;
          add(subject, first_order + left[i], tried, told.result);
          good = keep(tried, told.result, problem);
        });
    if (!good) throw io::EnvironmentError(problem);
  }

  /// False: it could not.
  bool keep(const Moments& moments, const Result& result, std::string& problem) {
    try {
      state_.add(to_string(moments), result);
      return true;
    } catch (const io::EnvironmentError& error) {
      problem = error.what();
      return false;
    }
  }

  void add(const Subject& subject, std::size_t order, const Moments& moments, const Result& result) {
    results_.add(subject.name, order, moments, result);
    ++tried_;
    progress_.show(fmt::format("{} runs, {} broken, {} left", tried_, results_.broken(), left_));
  }

  static std::string fingerprint(const Subject& subject, const Record& record) {
    std::string all = std::string(kVersion) + subject.identity;
    for (const std::string& frame : record.frames)
      all += frame + '\n';
    return fmt::format("{:016x}", explore::hash_of(all));
  }

  const cli::SearchConfig& search_;
  Console& console_;
  StateFile state_;
  std::optional<ResultFile> junit_;
  const cli::Shard shard_ = cli::shard_of(search_.shard);
  const Time begun_ = io::Reactor::now();
  const Time budget_ = text::parse_duration(search_.budget).value_or(kNever);
  Progress progress_;
  explore::Results results_;
  std::size_t offered_ = 0;  ///< moments of all parts
  std::size_t tried_ = 0;
  std::size_t left_ = 0;
  std::size_t distinct_ = 0;
  std::string failures_;  ///< as text
  std::string error_;     ///< which has ended the search
  options::ExitCode exit_code_ = options::ExitCode::kDone;
};

/// A file that adds the faults to the plant or scenario of another one.
std::string write_file(const std::string& folder, const std::string& name, const std::string& plant,
                       const std::string& command, explore::Settings settings,
                       const explore::Failure& failure, const std::string& steps) {
  const std::string path = std::filesystem::path(folder) / name;
  settings.only = {{to_string(failure.moments)}};
  ResultFile("--out", path)
      .write(fmt::format("# {}: {}\n# {}\nplant = {}\n\n[explore]\n{}{}", text::to_utf8(failure.result.what),
                         text::to_utf8(failure.result.seen.substr(0, failure.result.seen.find('\n'))),
                         text::to_utf8(command), scenario::toml_text(plant), text_of(settings), steps));
  return path;
}

std::string write_plant_file(const cli::Start& start, const explore::Settings& settings,
                             const explore::Failure& failure) {
  const std::string name = file_name_of(failure.moments);
  const std::string plant = absolute_plant(start.plant_file);
  return write_file(start.search.out, name, plant.empty() ? "demo" : plant,
                    fmt::format("cbcan-sim --config {} --explore -- {}", name, fmt::join(start.command, " ")),
                    settings, failure, "");
}

/// With as few steps as possible.
std::string write_scenario(const scenario::Scenario& scenario, const explore::Settings& settings,
                           const cli::SearchConfig& search, config::EdsFiles& files,
                           const explore::Failure& failure) {
  const explore::ShrunkScenario shrunk = explore::with_fewer_steps(scenario, failure, settings, files);
  const std::string name =
      std::filesystem::path(scenario.file).stem().string() + "-" + file_name_of(shrunk.failure.moments);
  std::string steps;
  for (const scenario::Step& step : shrunk.scenario.steps)
    steps += "\n[[step]]\n" + text_of(step);
  return write_file(search.out, name, std::filesystem::absolute(scenario.file).string(),
                    "cbcan-sim run " + name, settings, shrunk.failure, steps);
}

/// With each seed. Gave up = failed: nothing has disturbed it.
int run_seeds(const cli::Start& start, config::EdsFiles& files, const explore::Settings& settings,
              Console& console) {
  const cli::Seeds seeds = cli::seeds_of(start.search.seeds);
  const Record nothing_known;
  Processes runs(start, files, settings);
  scenario::SeedOutcomes outcomes;
  const std::size_t count = std::size_t{seeds.last} - seeds.first + 1;
  runs.all(
      count,
      [&](std::size_t i) {
        Run run{.config = start.config, .undisturbed = &nothing_known};
        run.config.seed = static_cast<std::uint32_t>(seeds.first + i);
        return run;
      },
      [] { return true; },
      [&](std::size_t i, const Told& told) {
        if (told.is_usage) throw io::UsageError(told.problem);
        if (!told.problem.empty()) throw io::EnvironmentError(told.problem);
        const bool good = told.result.verdict == explore::Verdict::kDone;
        outcomes.add(static_cast<std::uint32_t>(seeds.first + i),
                     {good ? scenario::Verdict::kPassed : scenario::Verdict::kFailed, told.result.duration,
                      good ? "" : explore::report(told.result)});
      });
  const scenario::Outcome all =
      outcomes.sum("cbcan-sim ...", fmt::format("-- {}", fmt::join(start.command, " ")));
  console.say(scenario::report(start.command.front(), all));
  return static_cast<int>(all.verdict == scenario::Verdict::kPassed ? options::ExitCode::kDone
                                                                    : options::ExitCode::kCheckFailed);
}

}  // namespace

std::size_t at_a_time(const cli::SearchConfig& search) {
  return search.jobs != 0 ? search.jobs : std::max(1U, std::thread::hardware_concurrency());
}

int run_many(const cli::Start& start, const explore::Settings& settings, config::EdsFiles& files,
             Console& console) {
  if (!start.search.explore) return run_seeds(start, files, settings, console);
  Processes runner(start, files, settings);
  Search search(start.search, console);
  config::Config plant = start.config;
  const std::string identity =
      fmt::format("{}\n{}\n{}", start.plant_text, fmt::join(start.words, " "), fmt::join(start.command, " "));
  search.run({"", identity, start.config, settings, explore::only(start.search.only, settings, plant), runner,
              [&](const explore::Failure& failure) { return write_plant_file(start, settings, failure); }});
  return static_cast<int>(search.report());
}

options::ExitCode explore_scenarios(const std::vector<std::string>& paths, const cli::SearchConfig& search,
                                    const text::FileReader& read, Console& console) {
  std::vector<config::EdsFiles> files(at_a_time(search), config::EdsFiles(read));
  Search all(search, console);
  for (const std::string& path : paths) {
    scenario::Scenario scenario = scenario::read_scenario(read(path).value_or(""), path, read);
    if (!scenario.problems.empty()) throw io::UsageError(to_string(scenario.problems.front()));
    const explore::Settings settings = explore::read_settings(scenario.text, path);
    const Moments only = explore::only(search.only, settings, scenario.config);
    Threads runner(scenario, files, settings);
    all.run(
        {path, scenario.text, scenario.config, settings, only, runner, [&](const explore::Failure& failure) {
           return write_scenario(scenario, settings, search, files.front(), failure);
         }});
  }
  return all.report();
}

}  // namespace cbcan::app

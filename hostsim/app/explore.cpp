// SPDX-License-Identifier: MIT
#include "app/explore.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "app/processes.hpp"
#include "app/progress.hpp"
#include "app/told_json.hpp"
#include "cbcan/version.hpp"
#include "explore/exploration.hpp"
#include "explore/scenario_run.hpp"
#include "explore/shrink.hpp"
#include "files/read_file.hpp"
#include "io/loop/output.hpp"
#include "scenario/outcome.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::app {

namespace {

using explore::Moments;
using explore::Record;
using explore::Result;
using explore::Run;
using explore::Told;
using nlohmann::json;

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
    std::atomic<std::size_t> next = 0;
    std::mutex one;
    const auto work = [&](config::EdsFiles& files) {
      for (std::size_t i = next++; i < count && wanted(); i = next++) {
        Told told;
        try {
          told = explore::play(scenario_, make(i), settings_, files);
        } catch (const std::exception& error) {
          told.problem = error.what();
        }
        const std::scoped_lock lock(one);
        ended(i, told);
      }
    };
    std::vector<std::jthread> others(std::min(files_.size(), std::max<std::size_t>(count, 1)) - 1);
    for (std::size_t i = 0; i < others.size(); ++i)
      others[i] = std::jthread([&, i] { work(files_[i + 1]); });
    work(files_[0]);
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

/// The results so far, in a file: a line for each run, under one that says what they belong to.
class State {
 public:
  /// Throws io::UsageError for the file of another search.
  State(const std::string& path, const std::string& fingerprint) : path_(path) {
    if (path.empty()) return;
    const auto text = files::read_file(path);
    std::string_view rest = text ? std::string_view(*text) : std::string_view();
    if (!rest.empty() && text::take_line(rest) != fingerprint)
      throw io::UsageError(
          fmt::format("--state {}: is of another program, plant, command or version; name a new file", path));
    while (rest.find('\n') != std::string_view::npos) {
      const json line = json::parse(text::take_line(rest), nullptr, false);
      if (!line.is_discarded()) known_.emplace(line.at(0), line.at(1).get<Result>());
    }
    file_.emplace(io::Output::open("--state", path));
    file_->add(fingerprint + "\n");
    for (const auto& [moments, result] : known_)
      add(moments, result);
  }

  const Result* find(const std::string& moments) const {
    const auto found = known_.find(moments);
    return found == known_.end() ? nullptr : &found->second;
  }
  void add(const std::string& moments, const Result& result) {
    if (!file_) return;
    file_->add(json{moments, result}.dump(-1, ' ', true, json::error_handler_t::replace) + "\n");
    file_->flush();
  }

 private:
  std::string path_;
  std::map<std::string, Result> known_;
  std::optional<io::Output> file_;
};

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
  Search(const cli::SearchConfig& search, Console& console) : search_(search), console_(console) {}

  /// Returns why the subject cannot be searched, or nothing.
  std::string run(const Subject& subject) {
    explore::Exploration exploration(subject.plant, subject.settings, subject.runner,
                                     words_in(search_.faults), words_in(search_.nodes));
    if (std::string problem = exploration.prepare(); !problem.empty()) return problem;
    std::vector<Moments> moments = subject.only.empty() ? exploration.moments() : std::vector<Moments>(1, subject.only);
    const cli::Shard shard = cli::shard_of(search_.shard);
    std::erase_if(moments,
                  [&](const Moments& each) { return !explore::is_in_part(each, shard.part, shard.parts); });
    if (search_.list) {
      for (const Moments& each : moments)
        console_.say(to_string(each) + "\n");
      return {};
    }
    for (const explore::Variant& variant : exploration.never())
      results_.add_never(variant);
    State state(search_.state, fingerprint(subject, exploration.record()));
    std::vector<explore::Pair> pairs;
    const bool pairs_wanted = search_.together == 2;
    try_all(subject, exploration, moments, state, pairs_wanted,
            [&](const Moments& first, const Record& record) {
              std::ranges::move(exploration.pairs(first, record), std::back_inserter(pairs));
            });
    try_all(subject, exploration, folded(std::move(pairs)), state, false, {});
    for (explore::Failure& failure : results_.failures(subject.name)) {
      failure = explore::earlier(exploration, subject.runner, std::move(failure));
      failures_ += fmt::format("\n{}{}\n  {}", subject.name.empty() ? "" : subject.name + ": ",
                               to_string(failure.moments), explore::report(failure.result));
      if (failure.count > 1) failures_ += fmt::format("  and {} more like it\n", failure.count - 1);
      if (!search_.out.empty()) failures_ += fmt::format("  replay: {}\n", subject.write(failure));
      ++distinct_;
    }
    for (std::size_t i = 0; i < subject.settings.reached.size() && left_ == 0; ++i)
      if (const std::string& text = subject.settings.reached[i].text; !results_.reached(subject.name, i)) {
        failures_ += fmt::format("\n{}reached {}: in no run, so nothing has been shown about it\n",
                                 subject.name.empty() ? "" : subject.name + ": ", text);
        ++distinct_;
      }
    return {};
  }

  int report() {
    if (search_.list) return 0;
    progress_.show("");
    console_.say(results_.table() + failures_);
    console_.say(fmt::format("\n{} runs, {} broken, {} distinct failures{}\n", tried_, results_.broken(),
                             distinct_, left_ != 0 ? fmt::format(", {} not tried", left_) : ""));
    if (!search_.junit.empty()) {
      io::Output file = io::Output::open("--junit", search_.junit);
      file.add(results_.junit(left_));
      file.flush();
    }
    return static_cast<int>(distinct_ == 0 ? options::ExitCode::kDone : options::ExitCode::kCheckFailed);
  }

 private:
  void try_all(const Subject& subject, const explore::Exploration& exploration,
               const std::vector<Moments>& moments, State& state, bool counts,
               const std::function<void(const Moments&, const Record&)>& on_record) {
    std::vector<std::size_t> left;
    const std::size_t first_order = tried_ + left_;
    for (std::size_t i = 0; i < moments.size(); ++i) {
      const Result* const known = counts ? nullptr : state.find(to_string(moments[i]));
      known != nullptr ? add(subject, first_order + i, moments[i], *known) : left.push_back(i);
    }
    left_ += left.size();
    subject.runner.all(
        left.size(), [&](std::size_t i) { return exploration.run_of(moments[left[i]], counts); },
        [&] { return io::Reactor::now() - begun_ < budget_; },
        [&](std::size_t i, const Told& told) {
          if (!told.problem.empty()) throw io::EnvironmentError(told.problem);
          const Moments& tried = moments[left[i]];
          --left_;
          add(subject, first_order + left[i], tried, told.result);
          state.add(to_string(tried), told.result);
          if (counts) on_record(tried, told.record);
        });
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
    return fmt::format("cbcan-sim --explore {:016x}", explore::hash_of(all));
  }

  const cli::SearchConfig& search_;
  Console& console_;
  const Time begun_ = io::Reactor::now();
  const Time budget_ = text::parse_duration(search_.budget).value_or(kNever);
  Progress progress_;
  explore::Results results_;
  std::size_t tried_ = 0;
  std::size_t left_ = 0;
  std::size_t distinct_ = 0;
  std::string failures_;  ///< as text
};

std::string conditions_text(const explore::Settings& settings) {
  std::string text;
  for (const auto& [key, lines] : {std::pair("always", &settings.always), std::pair("done", &settings.done),
                                   std::pair("gave_up", &settings.gave_up)}) {
    json texts = json::array();
    for (const explore::Line& line : *lines)
      texts.push_back(line.text);
    if (!texts.empty()) text += fmt::format("{} = {}\n", key, texts.dump());
  }
  return text;
}

std::string write_file(const std::string& folder, const std::string& name, const std::string& text) {
  const std::string path = std::filesystem::path(folder) / name;
  io::Output file = io::Output::open("--out", path);
  file.add(text);
  if (const int wrong = file.flush(); wrong != 0)
    throw io::EnvironmentError(fmt::format("--out {}: {}", path, io::reason(wrong)));
  return path;
}

/// A plant file that adds the faults to the plant of the command.
std::string write_plant_file(const cli::Start& start, const explore::Settings& settings,
                             const explore::Failure& failure) {
  const bool is_file = !start.plant_file.empty() && start.plant_file != "demo";
  const std::string plant = is_file ? std::filesystem::absolute(start.plant_file).string() : "demo";
  const std::string name = file_name_of(failure.moments);
  return write_file(start.search.out, name,
                    fmt::format("# {}: {}\n# cbcan-sim --config {} --clock manual -- {}\nplant = "
                                "\"{}\"\n\n[explore]\nonly = \"{}\"\n{}",
                                failure.result.what, failure.result.seen, name, fmt::join(start.command, " "),
                                plant, to_string(failure.moments), conditions_text(settings)));
}

/// The file without its steps and without the table [explore].
std::string without_steps(std::string_view text) {
  std::string kept;
  bool is_kept = true;
  while (!text.empty()) {
    const std::string_view line = text::take_line(text);
    if (line.starts_with('[')) is_kept = !line.starts_with("[[step]]") && !line.starts_with("[explore]");
    if (is_kept) kept += std::string(line) + "\n";
  }
  return kept;
}

/// With as few steps as possible.
std::string write_scenario(const scenario::Scenario& scenario, const explore::Settings& settings,
                           const cli::SearchConfig& search, config::EdsFiles& files,
                           const explore::Failure& failure) {
  const explore::ShrunkScenario shrunk = explore::with_fewer_steps(scenario, failure, settings, files);
  const std::string name =
      std::filesystem::path(scenario.file).stem().string() + "-" + file_name_of(shrunk.failure.moments);
  return write_file(
      search.out, name,
      fmt::format("# {}: {}\n# cbcan-sim run {}\n{}\n[explore]\nonly = \"{}\"\n{}{}", failure.result.what,
                  failure.result.seen.substr(0, failure.result.seen.find('\n')), name,
                  without_steps(scenario.text), to_string(shrunk.failure.moments), conditions_text(settings),
                  explore::steps_text(shrunk.scenario)));
}

}  // namespace

std::size_t at_a_time(const cli::SearchConfig& search) {
  return search.jobs != 0 ? search.jobs : std::max(1U, std::thread::hardware_concurrency());
}

namespace {

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
        if (!told.problem.empty()) throw io::EnvironmentError(told.problem);
        const bool good = told.result.verdict == explore::Verdict::kDone;
        outcomes.add(
            static_cast<std::uint32_t>(seeds.first + i),
            {good ? scenario::Verdict::kPassed : scenario::Verdict::kFailed, told.result.duration,
             good ? ""
                  : fmt::format("{}: {} {}\n  during: {}\n{}", name_of(told.result.verdict), told.result.what,
                                told.result.seen, told.result.during, told.result.frames)});
      });
  const scenario::Outcome all =
      outcomes.sum("cbcan-sim ...", fmt::format("-- {}", fmt::join(start.command, " ")));
  console.say(scenario::report(start.command.front(), all));
  return static_cast<int>(all.verdict == scenario::Verdict::kPassed ? options::ExitCode::kDone
                                                                    : options::ExitCode::kCheckFailed);
}

}  // namespace

int run_many(const cli::Start& start, const explore::Settings& settings, config::EdsFiles& files,
             Console& console) {
  if (!start.search.explore) return run_seeds(start, files, settings, console);
  Processes runner(start, files, settings);
  Search search(start.search, console);
  config::Config plant = start.config;
  const std::string identity =
      fmt::format("{}\n{}\n{}", start.plant_text, fmt::join(start.words, " "), fmt::join(start.command, " "));
  const std::string problem = search.run(
      {"", identity, start.config, settings, explore::only(start.search.only, settings, plant), runner,
       [&](const explore::Failure& failure) { return write_plant_file(start, settings, failure); }});
  if (!problem.empty()) throw io::UsageError(problem);
  return search.report();
}

options::ExitCode explore_scenarios(const std::vector<std::string>& paths, const cli::SearchConfig& search,
                                    const config::FileReader& read, Console& console) {
  std::vector<config::EdsFiles> files(at_a_time(search), config::EdsFiles(read));
  Search all(search, console);
  for (const std::string& path : paths) {
    scenario::Scenario scenario = scenario::read_scenario(read(path).value_or(""), path, read);
    if (!scenario.problems.empty()) throw io::UsageError(to_string(scenario.problems.front()));
    const explore::Settings settings = explore::read_settings(scenario.text, path);
    const Moments only = explore::only(search.only, settings, scenario.config);
    Threads runner(scenario, files, settings);
    const std::string problem = all.run(
        {path, scenario.text, scenario.config, settings, only, runner, [&](const explore::Failure& failure) {
           return write_scenario(scenario, settings, search, files.front(), failure);
         }});
    if (!problem.empty()) throw io::UsageError(fmt::format("{}: {}", path, problem));
  }
  return static_cast<options::ExitCode>(all.report());
}

}  // namespace cbcan::app

// SPDX-License-Identifier: MIT
#include "scenario/search/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "base/files.hpp"
#include "base/text.hpp"
#include "cbcan/version.hpp"
#include "config/plant_file.hpp"
#include "scenario/outcome.hpp"
#include "scenario/run.hpp"
#include "scenario/scenario_writer.hpp"
#include "scenario/search/scenario_run.hpp"
#include "scenario/search/search.hpp"

namespace cbcan::search {

namespace {

using config::kDemo;

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
bool is_repeat(const Failure& failure, const Failure& other) {
  const auto is_in_failure = [&failure](const Moment& moment) {
    return std::ranges::any_of(failure.moments, [&](const Moment& later) {
      return later == moment ||
             (later.variant() == moment.variant() && !search::passes(moment.variant().fault));
    });
  };
  return other.result.what == failure.result.what && std::ranges::all_of(other.moments, is_in_failure);
}

/// The search for failures of any number of subjects.
class Search final : public Campaign {
 public:
  Search(const config::SearchConfig& search, Host& host, Kept& kept)
      : search_(search), host_(host), state_(kept) {}

  void run(const Subject& subject) override {
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

  base::ExitCode report() override {
    host_.show_progress("");
    if (offered_ == 0 && error_.empty()) {
      error_ = "without faults, no frame matches one of these, so nothing can be tried";
      exit_code_ = base::ExitCode::kUsage;
    }
    if (!error_.empty()) host_.tell(fmt::format("cbcan-sim: {}\n", error_));
    if (!search_.list && (error_.empty() || tried_ != 0))
      host_.say(fmt::format("{}{}\nruns: {}, broken: {}, distinct failures: {}{}\n", results_.table(),
                            failures_, tried_, results_.broken(), distinct_,
                            left_ != 0 ? fmt::format(", not tried: {}", left_) : ""));
    return error_.empty() && distinct_ != 0 ? base::ExitCode::kCheckFailed : exit_code_;
  }

  std::string junit() const override { return results_.junit(left_, error_); }
  std::unique_ptr<Campaign> copy() const override { return std::make_unique<Search>(*this); }

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
    Exploration exploration(subject.plant, subject.settings, subject.runner, faults, words_in(search_.nodes));
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
        host_.say(to_string(each) + "\n");
      return;
    }
    for (const Variant& variant : exploration.unmatched())
      results_.add_unmatched(variant);
    Pairs pairs;
    try_all(subject, exploration, moments, is_in_pairs() ? &pairs : nullptr);
    if (is_in_pairs()) {
      moments = pairs.take();
      others += leave_out_others(exploration, moments);
      try_all(subject, exploration, moments, nullptr);
    }
    add_failures(subject, exploration);
    if (left_ == 0 && others == 0) check_shown(subject);
  }

  void add_failures(const Subject& subject, const Exploration& exploration) {
    for (const Failure& failure : shrunk(subject, exploration)) {
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
  std::vector<Failure> shrunk(const Subject& subject, const Exploration& exploration) {
    std::vector<Failure> distinct;
    const auto is_known = [&distinct](const Failure& failure) {
      const auto known = std::ranges::find_if(
          distinct, [&failure](const Failure& other) { return is_repeat(failure, other); });
      if (known != distinct.end()) known->count += failure.count;
      return known != distinct.end();
    };
    for (Failure& failure : results_.failures(subject.name)) {
      if (is_known(failure)) continue;
      Failure simple = search::earlier(exploration, subject.runner, std::move(failure));
      if (!is_known(simple)) distinct.push_back(std::move(simple));
    }
    return distinct;
  }

  bool is_in_pairs() const { return search_.together == 2; }

  /// Removes those of other parts, unless --state has their results. Returns their number. A pair is of the
  /// part that makes the run with its first fault alone, so each of these is made once.
  std::size_t leave_out_others(const Exploration& exploration, std::vector<Moments>& moments) const {
    return std::erase_if(moments, [&](const Moments& each) {
      const bool is_ours = is_in_pairs() ? exploration.number_of(each) % shard_.parts == shard_.part - 1
                                         : search::is_in_part(each, shard_.part, shard_.parts);
      return !is_ours && !state_.has(to_string(each));
    });
  }

  /// Tries all moments. `pairs` gets those with each of them.
  void try_all(const Subject& subject, const Exploration& exploration, const std::vector<Moments>& moments,
               Pairs* pairs) {
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
        [&] { return good && host_.searched() < budget_; },
        [&](std::size_t i, const TrialReport& report) {
          const Moments& tried = moments[left[i]];
          if (!report.problem.empty()) {
            problem = fmt::format("{}: {}", to_string(tried), report.problem);
            good = false;
          }
          if (!good) return;
          --left_;
          KeptRun run{to_string(tried), report.result, {}};
          if (pairs != nullptr) {
            run.near = exploration.near(tried, report.record);
            pairs->add(exploration.pairs(tried, *run.near));
          }
          add(subject, first_order + left[i], tried, report.result);
          try {
            state_.add(run);
          } catch (const std::runtime_error& error) {
            problem = error.what();
            good = false;
          }
        });
    if (!good) throw std::runtime_error(problem);
  }

  void add(const Subject& subject, std::size_t order, const Moments& moments, const Result& result) {
    results_.add(subject.name, order, moments, result);
    ++tried_;
    host_.show_progress(fmt::format("{} runs, {} broken, {} left", tried_, results_.broken(), left_));
  }

  static std::string fingerprint(const Subject& subject, const Record& record) {
    Sources sources = subject.sources;
    sources.emplace(sources.begin(), "version", kVersion);
    std::string frames;
    for (const std::string& frame : record.frames)
      frames += frame + '\n';
    sources.emplace_back("run without faults", frames);
    return search::fingerprint_of(sources);
  }

  const config::SearchConfig& search_;
  Host& host_;
  Kept& state_;
  const config::Shard shard_ = config::shard_of(search_.shard);
  const Time budget_ = base::parse_duration(search_.budget).value_or(kNever);
  Results results_;
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
std::string write_file(Host& host, const std::string& path, std::string plant, const std::string& command,
                       Settings settings, const Failure& failure, const std::string& steps) {
  const auto whole = [&host](const std::string& name) {
    return scenario::absolute_plant(name, host.folder());
  };
  if (plant != kDemo) plant = base::relative_path(whole(path), whole(plant));
  settings.only = {{to_string(failure.moments)}};
  host.write(path,
             fmt::format("# {}: {}\n# {}\nplant = {}\n\n[explore]\n{}{}", base::to_utf8(failure.result.what),
                         base::to_utf8(failure.result.seen.substr(0, failure.result.seen.find('\n'))),
                         base::to_utf8(command), base::toml_text(plant), text_of(settings), steps));
  return path;
}

/// "NAME=VALUE " for each variable that is set.
std::string environment_of(const Settings& settings, const Host& host) {
  std::vector<std::string> names = base::column(settings.environment, &Line::text);
  names.emplace_back("PYTHONPATH");
  std::string text;
  for (const std::string& name : names)
    if (const auto value = host.variable(name)) text += fmt::format("{}={} ", name, *value);
  return text;
}

std::string write_plant_file(const config::Start& start, const Settings& settings, Host& host,
                             const Failure& failure) {
  const std::string path = scenario::absolute_plant(file_name_of(failure.moments), start.search.out);
  return write_file(host, path, start.plant_file.empty() ? std::string(kDemo) : start.plant_file,
                    fmt::format("{}cbcan-sim --config {} --explore -- {}", environment_of(settings, host),
                                path, fmt::join(start.command, " ")),
                    settings, failure, "");
}

/// Writes a scenario with as few steps as possible.
std::string write_scenario(const scenario::Scenario& scenario, const Settings& settings,
                           const config::SearchConfig& search, config::EdsFiles& files, Host& host,
                           const Failure& failure) {
  const search::ShrunkScenario shrunk = search::with_fewer_steps(scenario, failure, settings, files);
  const std::string name =
      fmt::format("{}-{}", scenario::stem_of(scenario.file), file_name_of(shrunk.failure.moments));
  const std::string path = scenario::absolute_plant(name, search.out);
  std::string steps;
  for (const scenario::Step& step : shrunk.scenario.steps)
    steps += "\n[[step]]\n" + text_of(step);
  return write_file(host, path, scenario.file, "cbcan-sim run " + path, settings, shrunk.failure, steps);
}

}  // namespace

std::string indented(std::string_view said) {
  std::string lines;
  while (!said.empty())
    lines += fmt::format("  | {}\n", base::to_utf8(base::take_line(said)));
  return lines;
}

TrialReport hanging(Time limit) {
  TrialReport report;
  report.result.verdict = Verdict::kBroken;
  report.result.what = "hangs";
  report.result.seen = fmt::format("no end within {} s of this machine's time, also alone", limit / kSecond);
  report.result.happened = true;
  return report;
}

/// Gave up = failed: nothing has disturbed it.
base::ExitCode run_seeds(const config::Start& start, Runner& runs, Host& host) {
  const config::Seeds seeds = config::seeds_of(start.search.seeds);
  const Record nothing_known;
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
        if (report.is_usage) throw base::UsageError(report.problem);
        if (!report.problem.empty()) throw std::runtime_error(report.problem);
        const bool good = report.result.verdict == search::Verdict::kDone;
        outcomes.add(static_cast<std::uint32_t>(seeds.first + i),
                     {good ? scenario::Verdict::kPassed : scenario::Verdict::kFailed, report.result.duration,
                      good ? "" : search::report(report.result)});
      });
  const scenario::Outcome all =
      outcomes.sum("cbcan-sim ...", fmt::format("-- {}", fmt::join(start.command, " ")));
  host.say(scenario::report(start.command.front(), all));
  return all.verdict == scenario::Verdict::kPassed ? base::ExitCode::kDone : base::ExitCode::kCheckFailed;
}

Subject subject_of(const config::Start& start, const Settings& settings, Runner& runner, Host& host) {
  config::Config plant = start.config;
  return {"",
          {{"plant", start.plant_text},
           {"option", fmt::format("{}", fmt::join(start.words, " "))},
           {"command", fmt::format("{}", fmt::join(start.command, " "))}},
          start.config,
          settings,
          search::only(start.search.only, settings, plant),
          runner,
          [&](const Failure& failure) { return write_plant_file(start, settings, host, failure); }};
}

Explored read_explored(const std::string& path, const std::string& only, const base::FileReader& read) {
  Explored file{.scenario = scenario::read_scenario(read(path).value_or(""), path, read)};
  if (!file.scenario.problems.empty()) throw base::UsageError(to_string(file.scenario.problems.front()));
  file.settings = search::read_settings(file.scenario.text, path);
  file.only = search::only(only, file.settings, file.scenario.config);
  return file;
}

Subject subject_of(const Explored& file, const config::SearchConfig& search, config::EdsFiles& files,
                   Runner& runner, Host& host) {
  const scenario::Scenario& scenario = file.scenario;
  return {scenario.file,
          {{"scenario", scenario.text}},
          scenario.config,
          file.settings,
          file.only,
          runner,
          [&](const Failure& failure) {
            return write_scenario(scenario, file.settings, search, files, host, failure);
          }};
}

std::unique_ptr<Campaign> make_campaign(const config::SearchConfig& search, Host& host, Kept& kept) {
  return std::make_unique<Search>(search, host, kept);
}

}  // namespace cbcan::search

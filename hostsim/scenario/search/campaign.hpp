// SPDX-License-Identifier: MIT
#pragma once

/// What --explore and --seeds do and print; the program around it runs the trials. Pure.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "config/build_node.hpp"
#include "config/command_line.hpp"
#include "scenario/scenario.hpp"
#include "scenario/search/exploration.hpp"
#include "scenario/search/state.hpp"

namespace cbcan::search {

/// The program around a search, which it outlives.
class Host {
 public:
  /// Takes whole lines of results.
  virtual void say(std::string_view lines) = 0;
  /// Takes whole lines of messages.
  virtual void tell(std::string_view lines) = 0;
  /// How far the search is; empty = it has ended.
  virtual void show_progress(const std::string& progress) = 0;
  /// Time on this machine's clock since the search has begun.
  virtual Time searched() const = 0;
  /// The absolute path of the current folder.
  virtual std::string folder() const = 0;
  /// A variable of the environment.
  virtual std::optional<std::string> variable(const std::string& name) const = 0;
  /// Writes a file of --out.
  virtual void write(const std::string& path, const std::string& text) = 0;

 protected:
  ~Host() = default;
};

/// What is searched: a command, or a scenario.
struct Subject {
  std::string name;  ///< of a scenario; empty for a command
  Sources sources;   ///< of the results, apart from what the run without faults shows
  const config::Config& plant;
  const Settings& settings;
  Moments only;  ///< the one run to make; empty = all
  Runner& runner;
  std::function<std::string(const Failure&)> write;  ///< returns the file that plays the failure
};

/// A scenario file without mistakes.
struct Explored {
  scenario::Scenario scenario;
  Settings settings{};
  Moments only{};
};
/// `only`: see config::SearchConfig. Throws base::UsageError for a mistake.
Explored read_explored(const std::string& path, const std::string& only, const base::FileReader& read);

/// What is referred to outlives them. Throws base::UsageError for a mistake in --only.
Subject subject_of(const config::Start& start, const Settings& settings, Runner& runner, Host& host);
Subject subject_of(const Explored& file, const config::SearchConfig& search, config::EdsFiles& files,
                   Runner& runner, Host& host);

/// The search for failures of any number of subjects.
class Campaign {
 public:
  virtual ~Campaign() = default;

  /// Nothing after an error. What a Runner throws, unless it is a std::exception, is passed on.
  virtual void run(const Subject& subject) = 0;
  /// After the last subject: says what was found. Returns the exit code.
  virtual base::ExitCode report() = 0;
  /// The same as JUnit XML.
  virtual std::string junit() const = 0;
  virtual std::unique_ptr<Campaign> copy() const = 0;
};
/// What is referred to outlives it.
std::unique_ptr<Campaign> make_campaign(const config::SearchConfig& search, Host& host, Kept& kept);

/// What a command has written, as a report shows it.
std::string indented(std::string_view said);
/// The report of a command that has not ended within the limit of this machine's time, twice.
TrialReport hanging(Time limit);

/// Runs a command with each seed, and returns the exit code. Throws base::UsageError, std::runtime_error.
base::ExitCode run_seeds(const config::Start& start, Runner& runs, Host& host);

}  // namespace cbcan::search

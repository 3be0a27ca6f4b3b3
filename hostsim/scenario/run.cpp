// SPDX-License-Identifier: MIT
#include "scenario/run.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"

namespace cbcan::scenario {

namespace {

Outcome wrong(const config::Diagnostics& problems) {
  Outcome outcome{Verdict::kWrong, 0, {}};
  for (const config::Diagnostic& problem : problems)
    outcome.text += to_string(problem) + "\n";
  return outcome;
}

}  // namespace

std::vector<std::string> scenario_files(std::span<const std::string> paths, std::size_t part,
                                        std::size_t parts, const FolderReader& list,
                                        const base::FileReader& read) {
  std::vector<std::string> files;
  const auto has_steps = [&read](const std::string& path) {
    return ("\n" + read(path).value_or("")).find("\n[[step]]") != std::string::npos;
  };
  for (const std::string& path : paths) {
    const auto in_folder = list(path);
    if (!in_folder) {
      files.push_back(path);
      continue;
    }
    const std::size_t before = files.size();
    std::ranges::copy_if(*in_folder, std::back_inserter(files), has_steps);
    if (files.size() == before) throw base::UsageError(path + ": no file *.toml in it has a [[step]]");
  }
  std::ranges::sort(files);
  files.erase(std::unique(files.begin(), files.end()), files.end());
  std::vector<std::string> chosen;
  for (std::size_t i = part - 1; i < files.size(); i += parts)
    chosen.push_back(files[i]);
  return chosen;
}

std::string_view stem_of(std::string_view file) {
  const std::string_view name = file.substr(file.rfind('/') + 1);
  return name.substr(0, name.rfind('.'));
}

std::string log_name(const std::string& file, std::size_t network) {
  return fmt::format("{}{}.log", stem_of(file), network == 1 ? "" : fmt::format(".{}", network));
}

Outcome play_file(const std::string& file, std::optional<std::uint32_t> seed, const base::FileReader& read,
                  const std::function<Outcome(Scenario& scenario)>& play) try {
  const auto text = read(file);
  if (!text) return wrong({{{file}, "cannot be read; check the path and its permissions"}});
  Scenario scenario = read_scenario(*text, file, read);
  if (seed) scenario.config.seed = *seed;
  return scenario.problems.empty() ? play(scenario) : wrong(scenario.problems);
} catch (const std::exception& error) {
  return {Verdict::kWrong, 0, base::to_utf8(error.what()) + "\n"};
}

Outcome play_on_plant(const Scenario& scenario, config::EdsFiles& files, const PlantRun& run) {
  config::PlantBuild build = config::build_nodes(scenario.config, files);
  if (!build.good) {
    Outcome outcome{Verdict::kWrong, 0, {}};
    for (const std::string& line : build.lines)
      outcome.text += base::to_utf8(line) + "\n";
    return outcome;
  }
  plant::VirtualPlant plant(scenario.config, std::move(build), run.pace);
  if (const auto problems = check_steps(scenario, plant); !problems.empty()) return wrong(problems);
  if (run.check) return {};
  std::vector<std::shared_ptr<sim::Observer>> logs;
  for (std::size_t network = 1; network <= plant.control().networks() && run.log; ++network)
    plant.control().world(network).bus().observe(*logs.emplace_back(run.log(network)));
  plant.start();
  return play(scenario, plant);
}

}  // namespace cbcan::scenario

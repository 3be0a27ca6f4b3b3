// SPDX-License-Identifier: MIT
#pragma once

/// Scenario files from their names to their outcomes; what `cbcan-sim run` does, without files of its own.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.hpp"
#include "config/build_node.hpp"
#include "plant/plant.hpp"
#include "scenario/outcome.hpp"
#include "scenario/scenario.hpp"
#include "sim/bus.hpp"

namespace cbcan::scenario {

/// All files *.toml in a folder and below it; nullopt = this is no folder.
using FolderReader = std::function<std::optional<std::vector<std::string>>(const std::string& path)>;

/// The scenario files of part `part` (from 1) of `parts`, each once, even if it is named several times.
/// Throws base::UsageError for a folder without one.
std::vector<std::string> scenario_files(std::span<const std::string> paths, std::size_t part,
                                        std::size_t parts, const FolderReader& list,
                                        const base::FileReader& read);

/// The name of a file, without folder and ".toml".
std::string_view stem_of(std::string_view file);

/// Where the logs of a scenario are written: NAME.log, for network 2 NAME.2.log.
std::string log_name(const std::string& file, std::size_t network);

/// Plays a file as `play` does it, unless it has mistakes. `seed` replaces random.seed. What `play` throws
/// becomes an outcome.
Outcome play_file(const std::string& file, std::optional<std::uint32_t> seed, const base::FileReader& read,
                  const std::function<Outcome(Scenario& scenario)>& play);

struct PlantRun {
  bool check = false;              ///< only check
  plant::VirtualPlant::Pace pace;  ///< may be empty
  /// Makes what gets the frames of a network's bus; may be empty.
  std::function<std::shared_ptr<sim::Observer>(std::size_t network)> log;
};

/// Plays on the scenario's plant.
Outcome play_on_plant(const Scenario& scenario, config::EdsFiles& files, const PlantRun& run);

}  // namespace cbcan::scenario

// SPDX-License-Identifier: MIT
// cbcan-sim: results on standard output, everything for people on standard error.

#include <cstdio>
#include <exception>
#include <iostream>
#include <utility>

#include "app/simulator.hpp"
#include "io/files/read_file.hpp"
#include "plant/build_node.hpp"
#include "plant/command_line.hpp"
#include "plant/demo_plant.hpp"

namespace cbcan::app {
namespace {

using plant::ExitCode;

void warn(const std::string& line) {
  std::cerr << "cbcan-sim: " << line << "\n";
}

/// All nodes of a network; or fewer, when what is wrong has been said.
std::vector<sim::NodeParts> build_nodes(const plant::Config& config, const plant::NetworkConfig& network,
                                        const plant::FileReader& read) {
  std::vector<sim::NodeParts> nodes;
  for (const plant::NodeConfig& node : network.nodes) {
    plant::NodeBuild build = plant::build_node(node, plant::node_seed(config, node), read);
    if (!config.verbose) build.notes.clear();
    for (const auto& lines : {build.warnings, build.problems, build.notes})
      for (const std::string& line : lines)
        std::cerr << line << "\n";
    if (build.node) nodes.push_back(std::move(*build.node));
  }
  return nodes;
}

ExitCode run(const plant::Config& config, const plant::FileReader& read) {
  bool good = true;
  std::vector<std::vector<sim::NodeParts>> nodes;
  for (const plant::NetworkConfig& network : config.networks) {
    nodes.push_back(build_nodes(config, network, read));
    good = good && nodes.back().size() == network.nodes.size();
  }
  if (!good) return ExitCode::kUsage;
  Simulator simulator(config, std::move(nodes), warn);
  std::cout << "ready " << simulator.where() << std::endl;
  simulator.run();
  if (config.verbose) std::cerr << simulator.summary();
  return ExitCode::kDone;
}

ExitCode start(int argc, char** argv) {
  const plant::FileReader read = plant::with_demo_plant(io::read_file);
  const plant::Start start = plant::parse_command_line(argc, argv, read);
  std::cout << start.out << std::flush;
  std::cerr << start.err;
  if (!start.run) return start.exit_code;
  try {
    return run(start.config, read);
  } catch (const io::UsageError& error) {
    warn(error.what());
    return ExitCode::kUsage;
  } catch (const std::exception& error) {
    warn(error.what());
    return ExitCode::kEnvironment;
  }
}

}  // namespace
}  // namespace cbcan::app

int main(int argc, char** argv) {
  return static_cast<int>(cbcan::app::start(argc, argv));
}

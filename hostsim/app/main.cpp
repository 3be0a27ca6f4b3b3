// SPDX-License-Identifier: MIT
// cbcan-sim: results on standard output, everything for people on standard error.

#include <cstdio>
#include <exception>
#include <iostream>
#include <utility>

#include "app/command_line.hpp"
#include "app/demo_plant.hpp"
#include "app/node_image.hpp"
#include "app/simulator.hpp"
#include "io/files/read_file.hpp"

namespace {

using cbcan::app::ExitCode;

void warn(const std::string& line) {
  std::cerr << "cbcan-sim: " << line << "\n";
}

/// All nodes of a network; or fewer, when what is wrong has been said, and `good` is false.
std::vector<cbcan::app::BuiltNode> build_nodes(const cbcan::app::Config& config,
                                               const cbcan::app::NetworkConfig& network,
                                               const cbcan::app::FileReader& read, bool& good) {
  std::vector<cbcan::app::BuiltNode> nodes;
  for (const cbcan::app::NodeConfig& node : network.nodes) {
    cbcan::app::NodeBuild build = cbcan::app::build_node(node, cbcan::app::node_seed(config, node), read);
    for (const std::string& line : build.warnings)
      std::cerr << line << "\n";
    for (const std::string& line : build.problems)
      std::cerr << line << "\n";
    if (config.verbose)
      for (const std::string& line : build.notes)
        std::cerr << line << "\n";
    if (build.node) nodes.push_back(std::move(*build.node));
  }
  good = good && nodes.size() == network.nodes.size();
  return nodes;
}

ExitCode run(const cbcan::app::Config& config, const cbcan::app::FileReader& read) {
  bool good = true;
  std::vector<std::vector<cbcan::app::BuiltNode>> nodes;
  for (const cbcan::app::NetworkConfig& network : config.networks)
    nodes.push_back(build_nodes(config, network, read, good));
  if (!good) return ExitCode::kUsage;
  cbcan::app::Simulator simulator(config, std::move(nodes), warn);
  std::cout << "ready " << simulator.where() << std::endl;
  simulator.run();
  if (config.verbose) std::cerr << simulator.summary();
  return ExitCode::kDone;
}

}  // namespace

int main(int argc, char** argv) {
  const cbcan::app::FileReader read = cbcan::app::with_demo_plant(cbcan::io::read_file);
  const cbcan::app::Start start = cbcan::app::parse_command_line(argc, argv, read);
  std::cout << start.out << std::flush;
  std::cerr << start.err;
  if (!start.run) return static_cast<int>(start.exit_code);
  try {
    return static_cast<int>(run(start.config, read));
  } catch (const cbcan::io::UsageError& error) {
    warn(error.what());
    return static_cast<int>(ExitCode::kUsage);
  } catch (const std::exception& error) {
    warn(error.what());
    return static_cast<int>(ExitCode::kEnvironment);
  }
}

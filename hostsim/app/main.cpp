// SPDX-License-Identifier: MIT
// cbcan-sim: results on standard output, everything for people on standard error.

#include <exception>
#include <utility>

#include "app/console.hpp"
#include "app/simulator.hpp"
#include "io/files/read_file.hpp"
#include "io/sockets/service_manager.hpp"
#include "plant/build_node.hpp"
#include "plant/command_line.hpp"
#include "plant/demo_plant.hpp"

namespace cbcan::app {
namespace {

using plant::ExitCode;

/// All nodes of a network; or fewer, when what is wrong has been said.
std::vector<sim::NodeParts> build_nodes(const plant::Config& config, const plant::NetworkConfig& network,
                                        const plant::FileReader& read, Console& console) {
  std::vector<sim::NodeParts> nodes;
  for (const plant::NodeConfig& node : network.nodes) {
    plant::NodeBuild build = plant::build_node(node, plant::node_seed(config, node), read);
    if (!config.verbose) build.notes.clear();
    for (const auto& lines : {build.warnings, build.problems, build.notes})
      for (const std::string& line : lines)
        console.tell(line + "\n");
    if (build.node) nodes.push_back(std::move(*build.node));
  }
  return nodes;
}

ExitCode run(const plant::Config& config, const plant::FileReader& read, Console& console) {
  bool good = true;
  std::vector<std::vector<sim::NodeParts>> nodes;
  for (const plant::NetworkConfig& network : config.networks) {
    nodes.push_back(build_nodes(config, network, read, console));
    good = good && nodes.back().size() == network.nodes.size();
  }
  if (!good) return ExitCode::kUsage;
  Simulator simulator(config, std::move(nodes), console);
  console.say("ready " + simulator.where() + "\n");
  io::tell_ready([&console](const std::string& line) { console.warn(line); });
  simulator.run();
  if (config.verbose) console.tell(simulator.summary());
  return ExitCode::kDone;
}

ExitCode start(int argc, char** argv, Console& console) {
  const plant::FileReader read = plant::with_demo_plant(io::read_file);
  const plant::Start start = plant::parse_command_line(argc, argv, read);
  console.tell(start.err);
  console.say(start.out);
  return start.run ? run(start.config, read, console) : start.exit_code;
}

ExitCode start(int argc, char** argv) {
  Console console;
  try {
    return start(argc, argv, console);
  } catch (const io::UsageError& error) {
    console.warn(error.what());
    return ExitCode::kUsage;
  } catch (const std::exception& error) {
    console.warn(error.what());
    return ExitCode::kEnvironment;
  }
}

}  // namespace
}  // namespace cbcan::app

int main(int argc, char** argv) {
  return static_cast<int>(cbcan::app::start(argc, argv));
}

// SPDX-License-Identifier: MIT
// cbcan-sim: results on standard output, everything for people on standard error.

#include <exception>
#include <span>
#include <string_view>
#include <utility>

#include "app/console.hpp"
#include "app/run.hpp"
#include "app/simulator.hpp"
#include "cli/command_line.hpp"
#include "config/build_node.hpp"
#include "config/demo_plant.hpp"
#include "io/files/file_text.hpp"
#include "io/files/parameter_file.hpp"
#include "io/sockets/service_manager.hpp"
#include "window/program_start.hpp"

namespace cbcan::app {
namespace {

using cli::ExitCode;

int code(ExitCode code) {
  return static_cast<int>(code);
}

/// Throws io::UsageError, as a start does.
void check_parameters(const config::Config& config, Console& console) {
  const auto check = [&](const std::string& file) {
    if (!file.empty()) io::ParameterFile(file, [&](const std::string& line) { console.warn(line); }).load();
  };
  for (const config::NetworkConfig& network : config.networks) {
    check(network.module.parameters);
    for (const config::NodeConfig& node : network.nodes)
      check(node.parameters);
  }
}

int run(const cli::Start& start, const config::FileReader& read, Console& console) {
  const config::Config& config = start.config;
  config::PlantBuild build = config::build_nodes(config, read);
  for (const std::string& line : build.lines)
    console.tell(line + "\n");
  if (build.good && start.check) check_parameters(config, console);
  if (!build.good || start.check) return code(build.good ? ExitCode::kDone : ExitCode::kUsage);
  Simulator simulator(config, std::move(build), console, start.command.empty());
  simulator.set_plant(start.plant_file);
  if (!config.record.empty()) simulator.record(config.record);
  int exit_code = code(ExitCode::kDone);
  if (start.command.empty()) {
    const std::string ready = "ready " + simulator.where() + "\n";
    config::logs_to_standard_output(config) ? console.tell(ready) : console.say(ready);
    console.tell(simulator.ways_in());
    io::tell_ready([&console](const std::string& line) { console.warn(line); });
    simulator.run();
  } else {
    exit_code = simulator.run(start.command);
  }
  if (config.summary || config.verbose || config.verbose_frames) console.tell(simulator.summary());
  return exit_code;
}

int start(int argc, char** argv, Console& console) {
  const config::FileReader read = config::with_demo_plant(io::read_file);
  if (argc > 1 && std::string_view(argv[1]) == "run") {
    const cli::RunStart start = cli::parse_run_command_line(std::span(argv + 2, argv + argc));
    console.tell(start.err);
    console.say(start.out);
    return code(start.run ? run_scenarios(start.config, read, console) : start.exit_code);
  }
  const cli::Start start = cli::parse_command_line(argc, argv, read);
  console.tell(start.err);
  console.say(start.out);
  return start.run ? run(start, read, console) : code(start.exit_code);
}

int start(int argc, char** argv) {
  Console console;
  try {
    return start(argc, argv, console);
  } catch (const io::UsageError& error) {
    console.warn(error.what());
    return code(ExitCode::kUsage);
  } catch (const CheckFailed& error) {
    console.warn(error.what());
    return code(ExitCode::kCheckFailed);
  } catch (const std::exception& error) {
    console.warn(error.what());
    return code(ExitCode::kEnvironment);
  }
}

}  // namespace
}  // namespace cbcan::app

int main(int argc, char** argv) {
  cbcan::window::start_program<static_cast<int>(cbcan::options::ExitCode::kEnvironment)>();
  return cbcan::app::start(argc, argv);
}

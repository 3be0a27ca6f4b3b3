// SPDX-License-Identifier: MIT
// cbcan-sim: results on standard output, messages on standard error.

#include <fmt/core.h>

#include <exception>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "app/console.hpp"
#include "app/run_many.hpp"
#include "app/simulator.hpp"
#include "base/address.hpp"
#include "base/command.hpp"
#include "base/read_file.hpp"
#include "base/text.hpp"
#include "config/build_node.hpp"
#include "config/command_line.hpp"
#include "config/plant_file.hpp"
#include "config/plant_settings.hpp"
#include "io/files/parameter_file.hpp"
#include "io/loop/process.hpp"
#include "scenario/search/moment.hpp"
#include "scenario/search/scenario_run.hpp"
#include "window/program_start.hpp"

namespace cbcan::app {
namespace {

using config::ExitCode;

int code(ExitCode code) {
  return static_cast<int>(code);
}

/// Throws io::UsageError for a missing folder of a file or socket, and for a serial port that is a file.
template <class Target>
void check_place(const base::Setting<Target>& row, const Target& target) {
  using base::Form;
  if (row.form != Form::kPath && row.form != Form::kAddress) return;
  const std::string text = std::get<std::string>(row.load(row, target));
  const std::string path =
      row.form == Form::kPath || text.empty() ? text : base::parse_stream_address(text).path;
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const std::string where = fmt::format("{} {}: ", row.key, path);
  std::error_code error;  // without permission, opening it reports the error
  if (!folder.empty() && !std::filesystem::is_directory(folder, error) &&
      error != std::errc::permission_denied)
    throw io::UsageError(where + "there is no folder " + folder + "; make it first");
  if (row.key == "rtu.device" && std::filesystem::is_regular_file(path, error))
    throw io::UsageError(where + "no serial port; write the path of one, such as /dev/ttyUSB0");
}

void check_places(const config::Config& config) {
  for (const auto& row : config::kPlantSettings)
    check_place(row, config);
  for (const config::NetworkConfig& network : config.networks) {
    for (const auto& row : config::kNetworkSettings)
      check_place(row, network);
    for (const config::NodeConfig& node : network.nodes)
      check_place(config::setting_of(config::kNodeSettings, "node.parameters"), node);
  }
}

int run(config::Start& start, const base::FileReader& read, Console& console) {
  const search::Settings explored = search::read_settings(start.plant_text, start.plant_file);
  const search::Moments faults = search::only(start.search.only, explored, start.config);
  if (!start.search.explore) search::inject(faults, start.config);
  const config::Config& config = start.config;
  config::EdsFiles files(read);
  config::PlantBuild build = config::build_nodes(config, files);
  if (start.check && build.good) config::compare_networks(config, build);
  for (const std::string& line : build.lines)
    console.tell((line.starts_with('-') ? "cbcan-sim: " : "") + base::to_utf8(line) +
                 "\n");  // about an option, not a file
  if (!build.good) return code(ExitCode::kUsage);
  check_places(config);
  if (start.check) {
    build.read = io::ParameterFile::text_of;  // as a start
    search::check_conditions(explored, config, std::move(build));
    return code(ExitCode::kDone);
  }
  if (start.search.explore || !start.search.seeds.empty()) return run_many(start, explored, files, console);
  Simulator simulator(config, std::move(build), start.plant_file, console, start.command.empty());
  int exit_code = code(ExitCode::kDone);
  if (start.command.empty()) {
    const session::Services& services = simulator.session().services();
    const std::string ready = "ready " + base::to_utf8(services.where()) + "\n";
    if (config::logs_to_standard_output(config))
      console.tell(ready);
    else
      console.say(ready);
    console.tell(services.ways_in());
    io::tell_ready([&console](const std::string& line) { console.warn(line); });
    simulator.run();
  } else {
    exit_code = simulator.run(start.command);
  }
  if (config.summary || config.verbose || config.verbose_frames) console.tell(simulator.summary());
  return exit_code;
}

/// `cbcan-sim eds NODE [OPTION...]`
int print_eds(int argc, char** argv, const base::FileReader& read, Console& console) {
  if (argc > 2 && std::string_view(argv[2]) == base::kHelpOption) {
    console.say(config::eds_help_text());
    return code(ExitCode::kDone);
  }
  const auto end = argc > 2 ? config::parse_wire_end(fmt::format("{}:1", argv[2])) : std::nullopt;
  if (!end) throw io::UsageError("eds: write cbcan-sim eds NODE --config FILE");
  const config::Start start = config::parse_command_line(argc - 2, argv + 2, read);
  console.tell(start.err);
  console.say(start.out);
  if (!start.run) return code(start.exit_code);
  const auto place = config::place_of(start.config, *end);
  if (!place) throw io::UsageError(fmt::format("eds {}: there is no such node in the plant", argv[2]));
  const config::NodeConfig& node = start.config.networks[end->network - 1].nodes[*place];
  const std::string path = config::description_of(node);
  config::EdsFiles files(read);
  const config::EdsFile* const file = files.find(path, {}, node.modules);
  if (file == nullptr) throw io::UsageError(path + ": this file cannot be read");
  console.say(file->text());
  return code(ExitCode::kDone);
}

int start(int argc, char** argv) {
  Console console;
  try {
    const base::FileReader read = config::with_demo_plant(base::read_file);
    if (argc > 1 && std::string_view(argv[1]) == "run") {
      const config::RunStart start = config::parse_run_command_line(std::span(argv + 2, argv + argc));
      console.tell(start.err);
      console.say(start.out);
      return code(start.run ? run_scenarios(start.config, read, console) : start.exit_code);
    }
    if (argc > 1 && std::string_view(argv[1]) == "eds") return print_eds(argc, argv, read, console);
    config::Start start = config::parse_command_line(argc, argv, read);
    console.tell(start.err);
    console.say(start.out);
    return start.run ? run(start, read, console) : code(start.exit_code);
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
  cbcan::window::start_program<static_cast<int>(cbcan::base::ExitCode::kEnvironment)>();
  return cbcan::app::start(argc, argv);
}

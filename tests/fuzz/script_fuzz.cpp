// SPDX-License-Identifier: MIT
// Any text as the script of a device: it is rejected with its file name, or runs. Whatever it does, the other node
// works, and a second run has the same result. What it declares is an EDS file without mistakes.

#include "config/build_node.hpp"
#include "config/plant_file.hpp"
#include "descriptions/network_file.hpp"
#include "devices/lua/lua_device.hpp"
#include "fuzz/fuzz.hpp"
#include "plant/plant.hpp"

namespace cbcan::fuzz {

namespace {

constexpr std::string_view kPlant = R"([[node]]
id = 20
eds = "demo:/generic.eds"
device = "t.lua"
[[node]]
id = 32
eds = "demo:/generic.eds"
)";

/// Each of a script's functions is called.
constexpr auto kCommands = std::to_array<std::string_view>(
    {"pass 2ms", "nmt start 20", "send 080#", "set 20 0x2001 1", "trigger write 20 0x2002 0 2 5",
     "wait transaction ended", "read 3700 8", "incident 20 stuck on", "pass 5ms", "get 20 0x2001",
     "get 20 0x2002", "get 20 0x2004", "get 20 0x2008", "nmt stop 20", "nmt reset-node 20", "faults 20"});

/// A script without an EDS file: what it declares is a device.
void check_declaration(std::string_view script) {
  std::string eds;
  try {
    eds = devices::eds_of_script("t.lua", script);
  } catch (const sim::BehaviourProblem&) {
    return;
  }
  std::vector<std::string> remarks;
  try {
    descriptions::parse_device(eds, "t.lua", 21, remarks);
  } catch (const base::UsageError& error) {
    require(false, error.what());
  }
}

std::string told_by(std::string_view script) {
  config::Config config;
  require(config::read_plant(kPlant, "plant.toml", config).empty(), "the plant is one");
  config::PlantBuild build = config::build_nodes(
      config,
      config::with_demo_plant([script](const std::string&) { return std::optional(std::string(script)); }));
  std::string told;
  for (const std::string& line : build.lines)
    told += line + "\n";
  if (!build.good) {
    require(told.starts_with("plant.toml:1: node 20: t.lua"), "a complaint names node and script");
    return told;
  }
  plant::VirtualPlant plant(config, std::move(build));
  plant.start();
  for (const std::string_view command : kCommands)
    told += plant.execute(command);
  plant.execute("trigger read 32 0x2001 0 1");
  require(plant.execute("read 3700") == "ok 0\n", "the node beside it is served");
  for (const std::string& line : plant.said())
    told += line + "\n";
  return told;
}

}  // namespace

void run(Input input) {
  const std::string_view script = text_of(input.rest());
  check_declaration(script);
  const std::string told = told_by(script);
  if (is_read_twice(script.size())) require(told_by(script) == told, "the same script does the same");
}

}  // namespace cbcan::fuzz

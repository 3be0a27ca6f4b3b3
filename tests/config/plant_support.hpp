// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "config/command_line.hpp"
#include "config/config.hpp"
#include "config/plant_file.hpp"

namespace cbcan::config::test {

using namespace cbcan::config;

using Lines = std::vector<std::string>;
using Files = std::map<std::string, std::string>;

Lines to_lines(const Diagnostics& diagnostics);

struct Plant {
  Config config;
  Lines errors;
};

/// Reads `text` as the file plant.toml.
Plant read(std::string_view text);

/// The result of `cbcan-sim ARGUMENTS...` with these files on the disk.
Start start(const std::vector<const char*>& arguments, const Files& files = {});

inline constexpr const char* kHint = "cbcan-sim --help shows all options\n";

/// The message for a wrong command line.
std::string refusal(const std::vector<const char*>& arguments, const Files& files = {});

/// A node with these members, and defaults for all others.
NodeConfig node_config(std::uint8_t id, std::string name, std::string eds, std::vector<InitialValue> objects,
                       Place place);

bool contains(std::string_view text, std::string_view part);

/// A plant file with node 5.
inline constexpr const char* kValve = R"([[node]]
id = 5
name = "Valve"
eds = "valve.eds"
heartbeat_ms = 1000
objects = [{ index = 0x2001, value = 1 }, { index = 0x2001, sub = 1, value = 2 }]
)";

}  // namespace cbcan::config::test

// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "cli/command_line.hpp"
#include "config/config.hpp"
#include "config/demo_plant.hpp"
#include "config/plant_file.hpp"

namespace cbcan::config::test {

using namespace cbcan::cli;

using Lines = std::vector<std::string>;
using Files = std::map<std::string, std::string>;

Lines to_lines(const Diagnostics& diagnostics);

struct Plant {
  Config config;
  Lines errors;
};

/// Reads `text` as the file plant.toml.
Plant read(std::string_view text);

/// What `cbcan-sim ARGUMENTS...` makes of its command line where these files are on the disk.
Start start(const std::vector<const char*>& arguments, const Files& files = {});

inline constexpr const char* kHint = "cbcan-sim --help shows all options\n";

/// The complaint about a command line that is refused.
std::string refusal(const std::vector<const char*>& arguments, const Files& files = {});

/// A file of the source tree; empty if it is not there.
std::string source_file(const std::string& path);

/// A node with these members, and all others as they are by default.
NodeConfig node_config(std::uint8_t id, std::string name, std::string eds, std::vector<InitialValue> objects,
                       Place place);

bool contains(std::string_view text, std::string_view part);

/// Each with the same text in front of it.
Lines behind(std::string_view front, Lines lines);

}  // namespace cbcan::config::test

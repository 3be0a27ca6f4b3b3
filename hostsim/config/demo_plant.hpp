// SPDX-License-Identifier: MIT
#pragma once

/// The plant of `--demo`: the files of plants/demo, embedded in the program when it is built.

#include <span>
#include <string_view>

#include "text/files.hpp"

namespace cbcan::config {

struct EmbeddedFile {
  std::string_view name;  ///< without a folder: "plant.toml"
  std::string_view text;
};

/// Generated from plants/demo by cmake/embed.cmake.
std::span<const EmbeddedFile> demo_files();

/// The path under which a reader made by with_demo_plant() finds the demo's plant file; its EDS files are
/// next to it.
inline constexpr std::string_view kDemoPlant = "demo:/plant.toml";

/// A reader with the demo's files under "demo:/", and `disk` for all other paths.
text::FileReader with_demo_plant(text::FileReader disk);

}  // namespace cbcan::config

// SPDX-License-Identifier: MIT
#pragma once

#include <map>

#include "base/words.hpp"
#include "demo.hpp"
#include "support/source_file.hpp"

namespace cbcan::plant::test {

using Files = std::map<std::string, std::string>;
inline const Files kNone;

/// Reads these files, those of the demo plant, and those of the source tree.
inline base::FileReader reader(const Files& files) {
  return config::with_demo_plant([&files](const std::string& path) -> std::optional<std::string> {
    if (const auto found = files.find(path); found != files.end()) return found->second;
    const std::string text = cbcan::test::source_file(path);
    return text.empty() ? std::nullopt : std::optional(text);
  });
}

struct Built {
  config::Config config;
  config::PlantBuild build;
};
inline Built build(const std::string& text, const Files& files) {
  Built built;
  REQUIRE(config::read_plant(text, "plant.toml", built.config).empty());
  built.build = config::build_nodes(built.config, reader(files));
  return built;
}

/// `files` outlives it.
inline std::unique_ptr<VirtualPlant> plant_of(const std::string& text, const Files& files) {
  Built built = build(text, files);
  INFO((built.build.lines.empty() ? "" : built.build.lines.front()));
  REQUIRE(built.build.good);
  auto plant = std::make_unique<VirtualPlant>(built.config, std::move(built.build));
  plant->start();
  return plant;
}

/// A node 20 with this script, and the generic node 32.
constexpr std::string_view kScripted = R"([[node]]
id = 20
eds = "demo:/generic.eds"
device = "t.lua"
[[node]]
id = 32
eds = "demo:/generic.eds"
)";

/// The response without "ok" and the line end; an error as it is.
inline std::string run(VirtualPlant& plant, std::string_view line) {
  const std::string response = plant.execute(line);
  const std::string_view text = base::trim(response);
  return std::string(base::trim(text.starts_with("ok") ? text.substr(2) : text));
}

}  // namespace cbcan::plant::test

// SPDX-License-Identifier: MIT
#pragma once

#include "demo.hpp"
#include "support/source_file.hpp"

namespace cbcan::plant::test {

using Files = std::map<std::string, std::string>;

/// Reads these files, those of the demo plant, and those of the source tree.
inline base::FileReader reader(Files files = {}) {
  return config::with_demo_plant(
      [files = std::move(files)](const std::string& path) -> std::optional<std::string> {
        if (const auto found = files.find(path); found != files.end()) return found->second;
        const std::string text = cbcan::test::source_file(path);
        return text.empty() ? std::nullopt : std::optional(text);
      });
}
inline base::FileReader script(std::string text) {
  return reader({{"t.lua", std::move(text)}});
}

struct Built {
  config::Config config;
  config::PlantBuild build;
};
inline Built build(std::string_view text, const base::FileReader& read) {
  Built built;
  REQUIRE(config::read_plant(text, "plant.toml", built.config).empty());
  built.build = config::build_nodes(built.config, read);
  return built;
}

inline std::unique_ptr<VirtualPlant> plant_of(std::string_view text,
                                              const base::FileReader& read = reader()) {
  config::Config config;
  REQUIRE(config::read_plant(text, "plant.toml", config).empty());
  return started(config, read);
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

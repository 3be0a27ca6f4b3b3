// SPDX-License-Identifier: MIT
#pragma once

#include "config/plant_file.hpp"
#include "plant/plant.hpp"
#include "sim/frame_text.hpp"
#include "support/catch.hpp"

namespace cbcan::plant::test {

inline std::optional<std::string> no_file(const std::string& /*path*/) {
  return std::nullopt;
}

/// The plant of a configuration without mistakes, started.
inline std::unique_ptr<VirtualPlant> started(const config::Config& config, const base::FileReader& read) {
  config::PlantBuild build = config::build_nodes(config, read);
  INFO((build.lines.empty() ? "" : build.lines.front()));
  REQUIRE(build.good);
  auto plant = std::make_unique<VirtualPlant>(config, std::move(build));
  plant->start();
  return plant;
}

/// The demo plant, with `more` appended to its plant file; `disk` has the files that this names.
inline std::unique_ptr<VirtualPlant> demo(std::string_view more = "", base::FileReader disk = no_file) {
  const base::FileReader read = config::with_demo_plant(std::move(disk));
  config::Config config;
  REQUIRE(config::read_plant(*read(std::string(config::kDemoPlant)), std::string(config::kDemoPlant), config)
              .empty());
  REQUIRE(config::read_plant(more, "more.toml", config).empty());
  return started(config, read);
}

/// The demo plant, whose module boots this network.
inline std::unique_ptr<VirtualPlant> booting(std::string_view network) {
  return demo("module.network = \"network.toml\"\n", [network](const std::string& path) {
    return path == "network.toml" ? std::optional<std::string>(network) : std::nullopt;
  });
}

/// The frames from now on, in the format of candump; of a further network with its number, "2/705#00".
struct Frames final : Listener {
  explicit Frames(VirtualPlant& plant) : Listener(plant.view()) {}
  void on_frame(std::size_t network, const Frame& frame, Time /*now*/) override {
    seen.push_back((network == 1 ? "" : std::to_string(network) + "/") + sim::frame_text(frame));
  }
  std::vector<std::string> seen;
};

}  // namespace cbcan::plant::test

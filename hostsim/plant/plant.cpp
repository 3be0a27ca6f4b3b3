// SPDX-License-Identifier: MIT
#include "plant/plant.hpp"

#include <utility>

namespace cbcan::plant {

Plant::Plant(const config::Config& config, config::PlantBuild build, const Time& now,
             NetworkListener& listener, const FindStore& find_store) {
  const NetworkContext context{now, schedule_, listener};
  const auto store = [&](const std::string& file) { return file.empty() ? nullptr : find_store(file); };
  std::vector<Network*> networks;
  for (std::size_t i = 0; i < config.networks.size(); ++i) {
    const config::NetworkConfig& network = config.networks[i];
    std::vector<sim::NodeParts>& nodes = build.networks[i];
    for (std::size_t node = 0; node < nodes.size(); ++node)
      nodes[node].parameters = store(network.nodes[node].parameters);
    networks_.push_back(std::make_unique<Network>(config, network, std::move(nodes), context,
                                                  store(network.module.parameters),
                                                  std::move(build.images[i])));
    networks_.back()->replay(std::move(build.replays[i]));
    networks.push_back(networks_.back().get());
  }
  wires_.emplace(config, networks, context);
  control_.emplace(std::move(networks), now);
}

void Plant::start(bool observed) {
  for (const auto& network : networks_)
    network->start(observed);
}

void Plant::advance() {
  for (const auto& network : networks_)
    network->advance();
}

}  // namespace cbcan::plant

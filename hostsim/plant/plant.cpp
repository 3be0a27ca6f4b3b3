// SPDX-License-Identifier: MIT
#include "plant/plant.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "base/text.hpp"

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
  wires_.emplace(config, build.wires, networks, context);
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

VirtualPlant::VirtualPlant(const config::Config& config, config::PlantBuild build, Pace pace)
    : parameters_(build.read),
      plant_(config, std::move(build), now_, *this,
             [this](const std::string& file) { return parameters_.find(file); }),
      pace_(std::move(pace)) {}

void VirtualPlant::on_fault(std::size_t /*network*/, std::string_view text, Time now) {
  constexpr std::size_t kMost = 10;
  if (said_.size() == kMost) said_.erase(said_.begin());
  said_.push_back(fmt::format("{} {}", base::seconds_text(now), text));
}

void VirtualPlant::set_time(Time time) {
  control().set_now(now_ = time);
  plant_.advance();
}

void VirtualPlant::advance(Time until) {
  const Time next = std::max(earlier(until, plant_.next_deadline()), now());
  if (pace_) pace_(next);
  set_time(next);
}

void VirtualPlant::advance_to(Time time) {
  while (now() < time)
    advance(time);
}

std::string VirtualPlant::execute(std::string_view line) {
  Reply reply = control().execute(line, now());
  set_time(now());
  if (!reply.wait) return std::move(reply.text);
  for (auto response = reply.wait->poll();; response = reply.wait->poll()) {
    if (response) return std::move(*response);
    advance(reply.wait->next_deadline());
  }
}

}  // namespace cbcan::plant

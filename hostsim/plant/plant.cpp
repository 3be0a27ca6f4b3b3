// SPDX-License-Identifier: MIT
#include "plant/plant.hpp"

#include <algorithm>
#include <utility>

#include "text/numbers.hpp"

namespace cbcan::plant {

Plant::Plant(const config::Config& config, config::PlantBuild build, Pace pace)
    : networks_(make_networks(config, std::move(build))),
      wires_(config, pointers(networks_), context()),
      control_(pointers(networks_), 0),
      pace_(std::move(pace)) {}

void Plant::start() {
  for (const auto& network : networks_)
    network->start(false);
}

std::vector<std::unique_ptr<Network>> Plant::make_networks(const config::Config& config,
                                                           config::PlantBuild build) {
  std::vector<std::unique_ptr<Network>> networks;
  for (std::size_t i = 0; i < build.networks.size(); ++i) {
    networks.push_back(
        std::make_unique<Network>(config, config.networks[i], std::move(build.networks[i]), context()));
    networks.back()->replay(std::move(build.replays[i]));
  }
  return networks;
}

void Plant::on_fault(std::size_t /*network*/, std::string_view text, Time now) {
  constexpr std::size_t kMost = 10;
  if (said_.size() == kMost) said_.erase(said_.begin());
  said_.push_back(fmt::format("{} {}", text::seconds_text(now), text));
}

std::vector<Network*> Plant::pointers(const std::vector<std::unique_ptr<Network>>& networks) {
  std::vector<Network*> all;
  for (const auto& network : networks)
    all.push_back(network.get());
  return all;
}

void Plant::advance(Time time) {
  control_.set_now(now_ = time);
  for (const auto& network : networks_)
    network->advance();
}

void Plant::step(Time until) {
  Time next = until;
  for (const auto& network : networks_)
    next = earlier(next, network->next_deadline());
  next = std::max(next, now());
  if (pace_) pace_(next);
  advance(next);
}

void Plant::pass_to(Time time) {
  while (now() < time)
    step(time);
}

std::string Plant::execute(std::string_view line) {
  Reply reply = control_.execute(line, now());
  advance(now());
  if (!reply.wait) return std::move(reply.text);
  for (auto response = reply.wait->look();; response = reply.wait->look()) {
    if (response) return std::move(*response);
    step(reply.wait->next_look());
  }
}

}  // namespace cbcan::plant

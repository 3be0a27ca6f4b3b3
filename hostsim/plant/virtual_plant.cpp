// SPDX-License-Identifier: MIT
#include "plant/virtual_plant.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "base/text.hpp"

namespace cbcan::plant {

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

// SPDX-License-Identifier: MIT
#include "link.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "cbcan/regmap.hpp"

namespace cbcan::cia405 {

namespace {

constexpr std::uint8_t kHighestUnit = 247;  ///< Modbus over Serial Line V1.02, 2.2

const LinkSettings& checked(const LinkSettings& settings) {
  if (settings.port < 1 || settings.port > std::numeric_limits<std::uint16_t>::max())
    throw std::invalid_argument("cia405: port " + std::to_string(settings.port) + ": must be 1..65535");
  if (settings.host.empty()) throw std::invalid_argument("cia405: no host: must be a name or an IP address");
  return settings;
}

}  // namespace

Link::Link(LinkSettings settings) : connected_(std::make_unique<Connected>(checked(settings))) {}

Link::~Link() = default;

void Link::poll(Time now) {
  connected_->poll(now);
}

bool Link::connected() const {
  return connected_->connection.state() == window::Connection::State::kOn;
}

const std::string& Link::problem() const {
  return connected_->connection.problem();
}

int Link::descriptor() const {
  return connected_->connection.descriptor();
}

short Link::events() const {
  return connected_->connection.events();
}

detail::Window* Link::window(std::uint8_t number, std::uint8_t channel) {
  if (number == 0 || number > kHighestUnit || channel > regmap::kMostChannels) return nullptr;
  return channel == 0 ? &connected_->free_window(number) : &connected_->window(number, channel);
}

detail::Window& Link::Connected::window(std::uint8_t unit, std::uint8_t channel) {
  return windows.try_emplace({unit, channel}, channel).first->second;
}

/// The first channel with nothing to do, else the one with the shortest queue.
detail::Window& Link::Connected::free_window(std::uint8_t unit) {
  const auto known = channels.find(unit);
  const std::uint8_t most = known == channels.end() ? regmap::kMostChannels : known->second;
  detail::Window* best = &window(unit, 1);
  for (std::uint8_t channel = 2; channel <= most && best->jobs() != 0; ++channel)
    if (window(unit, channel).jobs() < best->jobs()) best = &window(unit, channel);
  return *best;
}

/// What a channel has found out is of interest to others.
void Link::Connected::heed(detail::Window& window) {
  if (window.take_lost_settings())
    for (auto& [place, other] : windows)
      if (place.first == asked.first) other.forget_settings();
  if (!window.absent()) return;
  const std::uint8_t known = channels.try_emplace(asked.first, regmap::kMostChannels).first->second;
  channels[asked.first] = std::min(known, static_cast<std::uint8_t>(asked.second - 1));
  window.leave_to(this->window(asked.first, 1));
}

void Link::Connected::poll(Time now) {
  for (auto& [place, window] : windows)
    window.expire(now);
  move(now);
  if (ends == connection.ends()) return;
  ends = connection.ends();
  channels.clear();
  for (auto& [place, window] : windows)
    window.lost();
}

void Link::Connected::move(Time now) {
  connection.poll(now);
  if (connection.state() != window::Connection::State::kOn) return;
  if (connection.response_due() && !receive(now)) return;
  send(now);
}

bool Link::Connected::receive(Time now) {
  const std::optional<window::Response> response = connection.receive(now);
  if (!response) return false;
  detail::Window& window = windows.at(asked);
  window.answered(*response);
  heed(window);
  return true;
}

/// Networks and channels take turns: the first that has something to do behind the one that was asked last.
void Link::Connected::send(Time now) {
  auto next = windows.upper_bound(asked);
  for (std::size_t i = 0; i < windows.size(); ++i, ++next) {
    if (next == windows.end()) next = windows.begin();
    const std::optional<window::Request> request = next->second.next();
    if (!request) continue;
    asked = next->first;
    return connection.send(asked.first, *request, now);
  }
}

}  // namespace cbcan::cia405

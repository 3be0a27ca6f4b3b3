// SPDX-License-Identifier: MIT
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "cbcan/cia405.hpp"
#include "cbcan/regmap.hpp"
#include "window.hpp"
#include "window/connection.hpp"

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

struct Link::Connected {
  /// Unit ID (network) and channel.
  using Place = std::pair<std::uint8_t, std::uint8_t>;

  explicit Connected(const LinkSettings& settings)
      : connection(window::tcp_connection(
            settings.host, settings.port,
            {settings.response_timeout, settings.reconnect_after, settings.reconnect_after})) {}

  detail::Window& window(Place place) {
    return windows.try_emplace(place, place.second, changes[place.first]).first->second;
  }
  detail::Window& free_window(std::uint8_t unit);
  void receive(Time now);
  void send(Time now);

  std::unique_ptr<window::Connection> connection;
  std::map<std::uint8_t, unsigned> changes{};  ///< per network: see detail::Window
  std::map<Place, detail::Window> windows{};   ///< used by this connection
  Place asked{};                               ///< place of the last request
  unsigned ends = 0;                           ///< ended connections that the windows know of
};

Link::Link(LinkSettings settings) : connected_(std::make_unique<Connected>(checked(settings))) {}

Link::~Link() = default;

void Link::poll(Time now) {
  Connected& all = *connected_;
  for (auto& [place, window] : all.windows)
    window.expire(now);
  all.connection->poll(now);
  all.receive(now);
  if (all.connection->ready(now)) all.send(now);
  if (all.ends == all.connection->ends()) return;
  all.ends = all.connection->ends();
  for (auto& [place, window] : all.windows)
    window.leave_to(nullptr);
  all.windows.clear();
}

bool Link::connected() const {
  return connected_->connection->state() == window::Connection::State::kOn;
}

std::string Link::problem() const {
  return connected_->connection->problem();
}

int Link::descriptor() const {
  return connected_->connection->descriptor();
}

short Link::events() const {
  return connected_->connection->events();
}

detail::Window* Link::window(std::uint8_t number, std::uint8_t channel) {
  if (number == 0 || number > kHighestUnit || channel > regmap::kMostChannels) return nullptr;
  return channel == 0 ? &connected_->free_window(number) : &connected_->window({number, channel});
}

/// The first idle channel, else the one with the shortest queue.
detail::Window& Link::Connected::free_window(std::uint8_t unit) {
  detail::Window* best = &window({unit, 1});
  for (std::uint8_t channel = 2; channel <= regmap::kMostChannels && best->jobs() != 0; ++channel) {
    detail::Window& other = window({unit, channel});
    if (!other.absent() && other.jobs() < best->jobs()) best = &other;
  }
  return *best;
}

void Link::Connected::receive(Time now) {
  const std::optional<window::Response> response = connection->receive(now);
  if (!response) return;
  detail::Window& window = windows.at(asked);
  window.answered(*response);
  if (window.absent()) window.leave_to(&this->window({asked.first, 1}));
}

/// Networks and channels take turns: sends the request of the next one that has something to do.
void Link::Connected::send(Time now) {
  auto next = windows.upper_bound(asked);
  for (std::size_t i = 0; i < windows.size(); ++i, ++next) {
    if (next == windows.end()) next = windows.begin();
    const std::optional<window::Request> request = next->second.next();
    if (!request) continue;
    asked = next->first;
    return connection->send(asked.first, *request, now);
  }
}

}  // namespace cbcan::cia405

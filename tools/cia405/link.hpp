// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <utility>

#include "cbcan/cia405.hpp"
#include "window.hpp"
#include "window/tcp_connection.hpp"

namespace cbcan::cia405 {

struct Link::Connected {
  explicit Connected(const LinkSettings& given)
      : settings(given),
        connection(given.host, given.port,
                   {given.response_timeout, given.reconnect_after, given.reconnect_after}) {}

  void poll(Time now);
  void move(Time now);
  bool receive(Time now);
  void send(Time now);
  detail::Window& window(std::uint8_t unit, std::uint8_t channel);
  detail::Window& free_window(std::uint8_t unit);
  void heed(detail::Window& window);

  LinkSettings settings;
  window::TcpConnection connection;
  /// A unit ID, which is a network, and a channel.
  using Place = std::pair<std::uint8_t, std::uint8_t>;
  std::map<Place, detail::Window> windows{};
  std::map<std::uint8_t, std::uint8_t> channels{};  ///< how many a network has, where that is known
  Place asked{};                                    ///< whose request was the last
  unsigned ends = 0;                                ///< of connections, that the windows know of
};

}  // namespace cbcan::cia405

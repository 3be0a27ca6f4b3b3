// SPDX-License-Identifier: MIT
#pragma once

#include <map>

#include "cbcan/cia405.hpp"
#include "client/tcp_connection.hpp"
#include "window.hpp"

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

  LinkSettings settings;
  client::TcpConnection connection;
  std::map<std::uint8_t, detail::Window> windows{};
  std::uint8_t asked = 0;  ///< whose request was the last
  unsigned ends = 0;       ///< of connections, that the windows know of
};

}  // namespace cbcan::cia405

// SPDX-License-Identifier: MIT
#pragma once

/// What a running plant is reached by: the line "ready ...", lines for people, the environment of a command.

#include <cstddef>
#include <cstdint>
#include <list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocols/stream_session.hpp"

namespace cbcan::session {

struct Service {
  std::size_t network = 0;           ///< 0 = of all
  std::string_view name{};           ///< as in the line "ready ..."
  std::string listen{};              ///< as configured; empty = nothing listens
  std::string place{};               ///< with the real port; empty = it is not served
  protocols::MakeSession connect{};  ///< for each client; absent if the host has another way
  std::uint64_t connections = 0;     ///< of a bus service
  std::uint64_t lost = 0;            ///< frames that clients at the bus have not read in time
  bool has_warned = false;           ///< of browsers, which are turned away
};

/// All services, in the order of the line "ready ...".
class Services : public std::list<Service> {
 public:
  const Service& at(std::string_view name, std::size_t network = 0) const;
  Service& at(std::string_view name, std::size_t network = 0) {
    return const_cast<Service&>(std::as_const(*this).at(name, network));
  }

  /// "modbus=127.0.0.1:1502 can=virtual slcan=127.0.0.1:29536 2/can=virtual"
  std::string where() const;
  /// Lines for people: commands by which programs join the buses.
  std::string ways_in() const;
  /// "CBCAN_MODBUS=127.0.0.1:1502" and "CBCAN_SLCAN_2=..." of network 2
  std::vector<std::string> environment() const;
};

/// "slcan", of network 2 "2/slcan"
std::string key_of(const Service& service);

}  // namespace cbcan::session

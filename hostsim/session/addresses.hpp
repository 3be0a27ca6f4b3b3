// SPDX-License-Identifier: MIT
#pragma once

/// Where a running plant is reached: the line "ready ...", lines for people, the environment of a command.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/address.hpp"

namespace cbcan::session {

struct NetworkAddresses {
  std::size_t number = 1;
  std::string name{};  ///< prefix of messages
  std::string can{};   ///< as --can has it
  std::optional<base::StreamAddress> slcan{};
  std::optional<base::StreamAddress> socketcand{};
  std::string plc{};  ///< that owns the registers; empty = none
};

/// Addresses with the real ports; what is empty is not served.
struct Addresses {
  std::optional<base::ListenAddress> modbus{};
  std::string rtu{};
  std::optional<base::StreamAddress> rtu_tcp{};
  std::vector<NetworkAddresses> networks{};
  std::optional<base::StreamAddress> control{};
  std::optional<base::ListenAddress> http{};

  /// "modbus=127.0.0.1:1502 can=virtual slcan=127.0.0.1:29536 2/can=virtual"
  std::string where() const;
  /// Lines for people: commands by which programs join the buses.
  std::string ways_in() const;
  /// "CBCAN_MODBUS=127.0.0.1:1502" and "CBCAN_SLCAN_2=..." of network 2
  std::vector<std::string> environment() const;
};

}  // namespace cbcan::session

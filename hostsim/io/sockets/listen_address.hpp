// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "io/loop/descriptor.hpp"

namespace cbcan::io {

/// Where a server listens.
struct ListenAddress {
  std::string host;  ///< name, IPv4 or IPv6 address, without brackets
  std::uint16_t port = 0;

  friend bool operator==(const ListenAddress&, const ListenAddress&) = default;
};

/// Reads `HOST:PORT`, `[IPV6]:PORT`, `HOST` or `[IPV6]` (with `default_port`), and `:PORT` (127.0.0.1:
/// another address only when it is written down). Port 0 = any free one. Throws UsageError.
ListenAddress parse_listen_address(std::string_view text, std::uint16_t default_port);

/// As parse_listen_address() reads it, with an IPv6 address in brackets.
std::string to_string(const ListenAddress& address);

struct Listener {
  Descriptor socket;
  ListenAddress address;  ///< with the port that port 0 became
};

/// A non-blocking TCP listener on the first of the host's addresses that can be had, IPv4 before IPv6. A host
/// name is looked up, which may block. Throws EnvironmentError, its text beginning with `service` ("modbus")
/// and the address.
Listener listen_tcp(std::string_view service, const ListenAddress& address);

}  // namespace cbcan::io

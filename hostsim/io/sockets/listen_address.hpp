// SPDX-License-Identifier: MIT
#pragma once

#include <sys/socket.h>

#include <optional>
#include <string>
#include <string_view>

#include "io/loop/descriptor.hpp"
#include "text/address.hpp"

namespace cbcan::io {

using text::ListenAddress;

struct Listener {
  Descriptor socket;
  ListenAddress address;  ///< with the port that port 0 became
};

/// As the kernel has them.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

/// The first of a host's addresses, IPv4 before IPv6, with the port. A name is looked up, which may block.
/// Throws EnvironmentError, its text beginning with `where`.
SocketAddress looked_up(const std::string& where, const ListenAddress& address);

/// With the number of the host; none where that cannot be told.
std::optional<ListenAddress> address_of(const SocketAddress& address);

/// Of a socket, likewise.
std::optional<ListenAddress> own_address(int socket);

/// Whoever is at the other end of a connected TCP socket, as "HOST:PORT"; empty where that cannot be told.
std::string peer_of(int socket);

/// A non-blocking TCP listener on the first of the host's addresses that can be had, IPv4 before IPv6. A host
/// name is looked up, which may block. Throws EnvironmentError, its text beginning with `service` ("modbus")
/// and the address.
Listener listen_tcp(std::string_view service, const ListenAddress& address);

}  // namespace cbcan::io

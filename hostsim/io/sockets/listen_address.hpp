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

/// An address in the kernel's format.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

/// The first of a host's addresses, IPv4 before IPv6, with the port. A name is looked up, which may block.
/// Throws EnvironmentError, its text beginning with `where`.
SocketAddress looked_up(const std::string& where, const ListenAddress& address);

/// With a numeric host; nullopt if it cannot be determined.
std::optional<ListenAddress> address_of(const SocketAddress& address);

/// The address that a socket is bound to; nullopt as above.
std::optional<ListenAddress> own_address(int socket);

/// The other end of a connected TCP socket as "HOST:PORT"; empty if it cannot be determined.
std::string peer_of(int socket);

/// A non-blocking TCP listener on the first of the host's addresses that is available, IPv4 before IPv6. A host
/// name is looked up, which may block. Throws EnvironmentError, its text beginning with `service` ("modbus")
/// and the address.
Listener listen_tcp(std::string_view service, const ListenAddress& address);

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#include "io/sockets/listen_address.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include "io/errors.hpp"
#include "text/numbers.hpp"

namespace cbcan::io {

namespace {

struct AddressListDeleter {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
using AddressList = std::unique_ptr<addrinfo, AddressListDeleter>;

/// All addresses of a host, IPv4 before IPv6.
std::vector<SocketAddress> look_up(const std::string& where, const ListenAddress& address, int flags,
                                   const char* way_out) {
  addrinfo hints{};
  hints.ai_flags = flags | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const int error = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &list);
  if (error != 0) throw EnvironmentError(where + gai_strerror(error) + way_out);
  const AddressList owner(list);
  std::vector<SocketAddress> found;
  for (; list != nullptr; list = list->ai_next) {
    SocketAddress& made = found.emplace_back();
    made.size = list->ai_addrlen;
    std::memcpy(&made.storage, list->ai_addr, list->ai_addrlen);
  }
  std::stable_partition(found.begin(), found.end(),
                        [](const SocketAddress& entry) { return entry.get()->sa_family == AF_INET; });
  return found;
}

Descriptor try_listen(const SocketAddress& address) {
  Descriptor socket(::socket(address.get()->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  if (socket) setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (!socket || bind(socket.get(), address.get(), address.size) != 0 || listen(socket.get(), SOMAXCONN) != 0)
    return {};
  return socket;
}

std::string way_out(const ListenAddress& address, int error) {
  switch (error) {
    case EACCES:
      return "permission denied: ports below 1024 need root; use " +
             to_string(ListenAddress{address.host, static_cast<std::uint16_t>(address.port + 1000)});
    case EADDRINUSE:
      return "address in use: another program listens there; stop it, or use " +
             to_string(ListenAddress{address.host, 0}) + " for any free port";
    case EADDRNOTAVAIL:
      return "not an address of this machine; `ip address` lists them, 0.0.0.0 is all of them";
    default: return reason(error);
  }
}

/// The socket's address by `ask`: getsockname() or getpeername().
std::optional<ListenAddress> address_by(int (*ask)(int, sockaddr*, socklen_t*), int socket) {
  SocketAddress address;
  address.size = sizeof address.storage;
  auto* const storage = reinterpret_cast<sockaddr*>(&address.storage);
  return ask(socket, storage, &address.size) == 0 ? address_of(address) : std::nullopt;
}

}  // namespace

SocketAddress looked_up(const std::string& where, const ListenAddress& address) {
  return look_up(where, address, 0, "; write an IP address").front();
}

std::optional<ListenAddress> address_of(const SocketAddress& address) {
  std::array<char, NI_MAXHOST> host{};
  std::array<char, NI_MAXSERV> port{};
  if (getnameinfo(address.get(), address.size, host.data(), host.size(), port.data(), port.size(),
                  NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    return std::nullopt;
  return ListenAddress{host.data(), text::parse<std::uint16_t>(port.data()).value_or(0)};
}

std::optional<ListenAddress> own_address(int socket) {
  return address_by(getsockname, socket);
}

std::string peer_of(int socket) {
  const auto peer = address_by(getpeername, socket);
  return peer ? to_string(*peer) : std::string();
}

Listener listen_tcp(std::string_view service, const ListenAddress& address) {
  const std::string where = std::string(service) + " " + to_string(address) + ": ";
  int error = 0;
  for (const SocketAddress& entry :
       look_up(where, address, AI_PASSIVE, ": write an address of this machine, such as 127.0.0.1")) {
    Descriptor socket = try_listen(entry);
    if (socket) {
      auto bound = own_address(socket.get());
      if (!bound) throw EnvironmentError("listening socket: " + reason(errno));
      return {std::move(socket), std::move(*bound)};
    }
    if (error == 0) error = errno;
  }
  throw EnvironmentError(where + way_out(address, error));
}

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#include "io/sockets/listen_address.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <optional>
#include <vector>

#include "io/errors.hpp"
#include "text/numbers.hpp"

namespace cbcan::io {

namespace {

constexpr int kMaxHostText = 256;

struct AddressListDeleter {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
using AddressList = std::unique_ptr<addrinfo, AddressListDeleter>;

AddressList look_up(const std::string& where, const ListenAddress& address) {
  addrinfo hints{};
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const int error = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &list);
  if (error == 0) return AddressList(list);
  throw EnvironmentError(where + gai_strerror(error) +
                         ": write an address of this machine, such as 127.0.0.1");
}

Descriptor try_listen(const addrinfo& address) {
  Descriptor socket(
      ::socket(address.ai_family, address.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, address.ai_protocol));
  const int on = 1;
  if (socket) setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (!socket || bind(socket.get(), address.ai_addr, address.ai_addrlen) != 0 ||
      listen(socket.get(), SOMAXCONN) != 0)
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

/// What `ask`, getsockname() or getpeername(), says of the socket.
std::optional<ListenAddress> address_by(int (*ask)(int, sockaddr*, socklen_t*), int socket) {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  auto* address = reinterpret_cast<sockaddr*>(&storage);
  std::string host(kMaxHostText, '\0');
  std::string port(NI_MAXSERV, '\0');
  if (ask(socket, address, &size) != 0 || getnameinfo(address, size, host.data(), kMaxHostText, port.data(),
                                                      NI_MAXSERV, NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    return std::nullopt;
  host.resize(host.find('\0'));
  port.resize(port.find('\0'));
  return ListenAddress{host, text::parse<std::uint16_t>(port).value_or(0)};
}

}  // namespace

std::string peer_of(int socket) {
  const auto peer = address_by(getpeername, socket);
  return peer ? to_string(*peer) : std::string();
}

Listener listen_tcp(std::string_view service, const ListenAddress& address) {
  const std::string where = std::string(service) + " " + to_string(address) + ": ";
  const AddressList list = look_up(where, address);
  std::vector<const addrinfo*> candidates;
  for (const addrinfo* entry = list.get(); entry != nullptr; entry = entry->ai_next)
    candidates.push_back(entry);
  std::stable_partition(candidates.begin(), candidates.end(),
                        [](const addrinfo* entry) { return entry->ai_family == AF_INET; });
  int error = 0;
  for (const addrinfo* entry : candidates) {
    Descriptor socket = try_listen(*entry);
    if (socket) {
      auto bound = address_by(getsockname, socket.get());
      if (!bound) throw EnvironmentError("listening socket: " + reason(errno));
      return {std::move(socket), std::move(*bound)};
    }
    if (error == 0) error = errno;
  }
  throw EnvironmentError(where + way_out(address, error));
}

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#include "io/sockets/listen_address.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <memory>
#include <vector>

#include "io/errors.hpp"

namespace cbcan::io {

namespace {

constexpr int kMaxHostText = 256;

struct AddressListDeleter {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
using AddressList = std::unique_ptr<addrinfo, AddressListDeleter>;

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw UsageError("address \"" + std::string(text) + "\": " + why);
}

std::uint16_t parse_port(std::string_view text, std::string_view port) {
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc{} || end != port.data() + port.size())
    refuse(text, "the port is a number 0..65535, 0 = any free one");
  return number;
}

/// `[IPV6]` or `[IPV6]:PORT`.
ListenAddress parse_bracketed(std::string_view text, std::uint16_t default_port) {
  const std::size_t close = text.find(']');
  if (close == std::string_view::npos || close == 1) refuse(text, "an IPv6 address is written [::1]:1502");
  const std::string host(text.substr(1, close - 1));
  const std::string_view rest = text.substr(close + 1);
  if (rest.empty()) return {host, default_port};
  if (rest.front() != ':') refuse(text, "after ']' comes ':' and the port");
  return {host, parse_port(text, rest.substr(1))};
}

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
             to_string({address.host, static_cast<std::uint16_t>(address.port + 1000)});
    case EADDRINUSE:
      return "address in use: another program listens there; stop it, or use " +
             to_string({address.host, 0}) + " for any free port";
    case EADDRNOTAVAIL:
      return "not an address of this machine; `ip address` lists them, 0.0.0.0 is all of them";
    default: return reason(error);
  }
}

/// What the kernel says that the socket is bound to.
ListenAddress bound_address(int socket) {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  auto* address = reinterpret_cast<sockaddr*>(&storage);
  std::string host(kMaxHostText, '\0');
  std::string port(NI_MAXSERV, '\0');
  if (getsockname(socket, address, &size) != 0 ||
      getnameinfo(address, size, host.data(), kMaxHostText, port.data(), NI_MAXSERV,
                  NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    throw EnvironmentError("listening socket: " + reason(errno));
  host.resize(host.find('\0'));
  port.resize(port.find('\0'));
  return {host, parse_port(port, port)};
}

}  // namespace

ListenAddress parse_listen_address(std::string_view text, std::uint16_t default_port) {
  if (text.empty()) refuse(text, "write HOST:PORT, such as 127.0.0.1:1502");
  if (text.front() == '[') return parse_bracketed(text, default_port);
  const auto colons = std::count(text.begin(), text.end(), ':');
  if (colons > 1) refuse(text, "an IPv6 address is written [::1]:1502");
  const bool digits_only = text.find_first_not_of("0123456789") == std::string_view::npos;
  if (digits_only) refuse(text, "a port alone is written :" + std::string(text));
  if (colons == 0) return {std::string(text), default_port};
  const std::size_t colon = text.find(':');
  const std::string host(colon == 0 ? "127.0.0.1" : text.substr(0, colon));
  return {host, parse_port(text, text.substr(colon + 1))};
}

std::string to_string(const ListenAddress& address) {
  const bool ipv6 = address.host.find(':') != std::string::npos;
  return (ipv6 ? "[" + address.host + "]" : address.host) + ":" + std::to_string(address.port);
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
      ListenAddress bound = bound_address(socket.get());
      return {std::move(socket), std::move(bound)};
    }
    if (error == 0) error = errno;
  }
  throw EnvironmentError(where + way_out(address, error));
}

}  // namespace cbcan::io

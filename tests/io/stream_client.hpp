// SPDX-License-Identifier: MIT
#pragma once

/// A client of a byte stream server.

#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>

#include "io/sockets/listener.hpp"
#include "support/catch.hpp"

namespace cbcan::io {

struct StreamClient {
  explicit StreamClient(const StreamAddress& address) {
    address.path.empty() ? connect_to(looked_up("", {"127.0.0.1", address.tcp.port}))
                         : connect_unix(address.path);
  }
  /// By IPv4; not connected yet. `receive_buffer`: 0 = the system's.
  explicit StreamClient(int receive_buffer = 0) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    REQUIRE(socket_);
    if (receive_buffer != 0) set(SOL_SOCKET, SO_RCVBUF, receive_buffer);
  }
  void connect_to(const SocketAddress& address) {
    if (!socket_) socket_ = Descriptor(::socket(address.get()->sa_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    REQUIRE(connect(socket_.get(), address.get(), address.size) == 0);
  }

  void send(std::string_view text) {
    REQUIRE(::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(text.size()));
  }
  /// Sends as many characters as the server takes.
  std::size_t send_some(std::string_view text) {
    const ssize_t count = ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return count < 0 ? 0 : static_cast<std::size_t>(count);
  }
  const std::string& heard() {
    std::array<char, 4096> part;
    ssize_t count = 0;
    while ((count = recv(socket_.get(), part.data(), part.size(), MSG_DONTWAIT)) > 0)
      heard_.append(part.data(), static_cast<std::size_t>(count));
    if (count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) closed_ = true;
    return heard_;
  }
  bool closed() {
    heard();
    return closed_;
  }
  /// What has arrived since the last call.
  std::string take() {
    heard();
    return std::exchange(heard_, {});
  }
  void end_sending() { REQUIRE(shutdown(socket_.get(), SHUT_WR) == 0); }
  void leave() { socket_.reset(); }
  void slam() {
    const linger at_once{1, 0};
    set(SOL_SOCKET, SO_LINGER, at_once);
    leave();
  }
  template <class Value>
  void set(int level, int option, const Value& value) {
    setsockopt(socket_.get(), level, option, &value, sizeof value);
  }

 private:
  void connect_unix(const std::string& path) {
    SocketAddress address{.storage = {}, .size = sizeof(sockaddr_un)};
    address.storage.ss_family = AF_UNIX;
    path.copy(reinterpret_cast<sockaddr_un&>(address.storage).sun_path, path.size());
    connect_to(address);
  }

  Descriptor socket_;
  std::string heard_;
  bool closed_ = false;
};

}  // namespace cbcan::io

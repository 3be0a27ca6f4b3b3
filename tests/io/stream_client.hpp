// SPDX-License-Identifier: MIT
#pragma once

/// A client of a byte stream server, and a temporary path for its socket.

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>

#include "io/sockets/listener.hpp"
#include "support/catch.hpp"

namespace cbcan::io {

/// A temporary folder, and a socket's path in it.
struct Folder {
  Folder() { REQUIRE(mkdtemp(name_.data()) != nullptr); }
  ~Folder() {
    unlink(socket().c_str());
    rmdir(name_.c_str());
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string socket() const { return name_ + "/s"; }

 private:
  std::string name_ = "/tmp/cbcan_slcan_XXXXXX";
};

struct StreamClient {
  explicit StreamClient(const StreamAddress& address) {
    address.path.empty() ? connect_tcp(address.tcp.port) : connect_unix(address.path);
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
  void leave() { socket_.reset(); }
  void slam() {
    const linger at_once{1, 0};
    setsockopt(socket_.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    leave();
  }

 private:
  void connect_tcp(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socket_ = Descriptor(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    REQUIRE(connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  void connect_unix(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    socket_ = Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    REQUIRE(connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }

  Descriptor socket_;
  std::string heard_;
  bool closed_ = false;
};

}  // namespace cbcan::io

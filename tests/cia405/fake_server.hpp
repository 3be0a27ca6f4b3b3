// SPDX-License-Identifier: MIT
#pragma once

/// The test's own Modbus TCP server, whose responses are written byte by byte.

#include <netinet/in.h>
#include <sys/socket.h>

#include <stdexcept>
#include <string>

#include "base/text.hpp"
#include "cia405/plant.hpp"
#include "io/bytes.hpp"
#include "io/loop/system.hpp"

namespace cbcan::cia405::test {

struct FakeServer {
  FakeServer() : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    sockaddr* const where = reinterpret_cast<sockaddr*>(&address);
    if (bind(listener_.get(), where, size) != 0 || listen(listener_.get(), 1) != 0 ||
        getsockname(listener_.get(), where, &size) != 0)
      throw std::runtime_error("no server");
    port_ = ntohs(address.sin_port);
  }

  int port() const { return port_; }
  /// Accepts the client's connection.
  void accept() { client_ = io::Descriptor(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC)); }
  /// The next request without its first six bytes, in hexadecimal: unit ID, function code, ...
  std::string request() {
    return base::hex(receive(receive(6)[5]), "");
  }
  /// Sends bytes that are written in hexadecimal.
  void send(const std::string& hex) {
    const io::test::Bytes bytes = io::test::hex(hex);
    ::send(client_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  /// Sends a response: unit ID, function code, ...
  void respond(const std::string& hex) {
    send("0000000000" + base::hex(hex.size() / 2, 2) + hex);
  }
  /// Whether the client has closed the connection.
  bool left() {
    contract::wait_readable(client_.get(), "the client");
    char byte = 0;
    return recv(client_.get(), &byte, 1, MSG_DONTWAIT) <= 0;
  }
  /// From now on connections are not even refused.
  void stop() { listener_.reset(); }

 private:
  io::test::Bytes receive(std::size_t count) {
    contract::wait_readable(client_.get(), "the client");
    io::test::Bytes bytes(count);
    if (recv(client_.get(), bytes.data(), count, MSG_WAITALL) != static_cast<ssize_t>(count))
      throw std::runtime_error("the client has left");
    return bytes;
  }

  io::Descriptor listener_, client_;
  int port_ = 0;
};

}  // namespace cbcan::cia405::test

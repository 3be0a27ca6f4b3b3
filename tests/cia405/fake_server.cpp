// SPDX-License-Identifier: MIT
#include "cia405/fake_server.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <stdexcept>

namespace cbcan::cia405::test {

FakeServer::FakeServer() : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
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

void FakeServer::accept() {
  client_ = io::Descriptor(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
}

std::string FakeServer::request() {
  const std::string header = receive(6);
  return hex_of(receive(static_cast<unsigned char>(header[5])));
}

void FakeServer::send(const std::string& hex) {
  const std::string bytes = bytes_of(hex);
  ::send(client_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

void FakeServer::respond(const std::string& hex) {
  const std::string length(1, static_cast<char>(hex.size() / 2));
  send("0000000000" + hex_of(length) + hex);
}

bool FakeServer::left() {
  contract::wait_readable(client_.get(), "the client");
  char byte = 0;
  return recv(client_.get(), &byte, 1, MSG_DONTWAIT) <= 0;
}

std::string FakeServer::receive(std::size_t count) {
  std::string bytes;
  while (bytes.size() < count) {
    std::array<char, 300> part;
    contract::wait_readable(client_.get(), "the client");
    const ssize_t got = recv(client_.get(), part.data(), count - bytes.size(), 0);
    if (got <= 0) throw std::runtime_error("the client has left");
    bytes.append(part.data(), static_cast<std::size_t>(got));
  }
  return bytes;
}

}  // namespace cbcan::cia405::test

// SPDX-License-Identifier: MIT
// For comparison: a minimal Modbus TCP server for many clients, without a coprocessor. One epoll; for each
// request one recv(), FC 16 and FC 3 on registers without a check, one send().
// Prints its port; runs until it is killed.

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>

#include "bench.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::bench {

namespace {

constexpr std::size_t kHeaderBytes = 7;  // MBAP
constexpr std::uint8_t kWrite = 16;
using Bytes = std::array<std::uint8_t, 260>;

std::array<std::uint16_t, regmap::kRegisterFileWords> registers;

std::size_t word(const Bytes& bytes, std::size_t offset) {
  return static_cast<std::size_t>(bytes[offset] << 8 | bytes[offset + 1]);
}

/// Replaces the request by the response and returns its size.
std::size_t execute(Bytes& bytes) {
  const std::size_t first = word(bytes, kHeaderBytes + 1);
  const std::size_t count = word(bytes, kHeaderBytes + 3);
  std::size_t size = kHeaderBytes + 5;
  if (bytes[kHeaderBytes] == kWrite) {
    for (std::size_t i = 0; i < count; ++i)
      registers[first + i] = static_cast<std::uint16_t>(word(bytes, kHeaderBytes + 6 + 2 * i));
  } else {
    size = kHeaderBytes + 2;
    bytes[kHeaderBytes + 1] = static_cast<std::uint8_t>(2 * count);
    for (std::size_t i = 0; i < count; ++i) {
      bytes[size++] = static_cast<std::uint8_t>(registers[first + i] >> 8);
      bytes[size++] = static_cast<std::uint8_t>(registers[first + i]);
    }
  }
  bytes[5] = static_cast<std::uint8_t>(size - kHeaderBytes + 1);
  return size;
}

void serve(int socket) {
  Bytes bytes;
  if (recv(socket, bytes.data(), bytes.size(), 0) <= 0) return void(close(socket));
  send(socket, bytes.data(), execute(bytes), MSG_NOSIGNAL);
}

void watch(int epoll, int socket) {
  epoll_event event{.events = EPOLLIN, .data = {.fd = socket}};
  epoll_ctl(epoll, EPOLL_CTL_ADD, socket, &event);
}

void adopt(int epoll, int listener) {
  const int socket = accept(listener, nullptr, nullptr);
  const int on = 1;
  setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  watch(epoll, socket);
}

int listen_on_any_port() {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener, any, size) != 0 || listen(listener, SOMAXCONN) != 0) return -1;
  getsockname(listener, any, &size);
  std::printf("ready %d\n", ntohs(address.sin_port));
  std::fflush(stdout);
  return listener;
}

}  // namespace

void null_server(const Arguments& /*arguments*/) {
  const int listener = listen_on_any_port();
  require(listener >= 0, "cannot listen on 127.0.0.1");
  const int epoll = epoll_create1(0);
  watch(epoll, listener);
  std::array<epoll_event, 512> events;
  while (true) {
    const int count = epoll_wait(epoll, events.data(), events.size(), -1);
    for (int i = 0; i < count; ++i) {
      const int ready = events[static_cast<std::size_t>(i)].data.fd;
      ready == listener ? adopt(epoll, listener) : serve(ready);
    }
  }
}

}  // namespace cbcan::bench

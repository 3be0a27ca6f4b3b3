// SPDX-License-Identifier: MIT
// What there is to compare with: registers behind libmodbus and nothing else, served in the way of
// libmodbus's own example for many clients. Prints its port; runs until it is killed.

#include <modbus.h>
#include <netinet/in.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>

#include "cbcan/regmap.hpp"

namespace {

template <auto Free>
struct Freed {
  void operator()(auto* unused) const { Free(unused); }
};
using Context = std::unique_ptr<modbus_t, Freed<modbus_free>>;
using Mapping = std::unique_ptr<modbus_mapping_t, Freed<modbus_mapping_free>>;

int port_of(int listener) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

class BareServer {
 public:
  bool listen() {
    listener_ = modbus_tcp_listen(context_.get(), SOMAXCONN);
    if (listener_ < 0) return false;
    FD_ZERO(&open_);
    FD_SET(listener_, &open_);
    last_ = listener_;
    std::printf("ready %d\n", port_of(listener_));
    std::fflush(stdout);
    return true;
  }

  void serve() {
    fd_set ready = open_;
    if (select(last_ + 1, &ready, nullptr, nullptr, nullptr) < 0) return;
    const int last = last_;
    for (int socket = 0; socket <= last; ++socket)
      if (FD_ISSET(socket, &ready)) socket == listener_ ? accept() : respond(socket);
  }

 private:
  void accept() {
    const int socket = modbus_tcp_accept(context_.get(), &listener_);
    if (socket < 0) return;
    FD_SET(socket, &open_);
    last_ = std::max(last_, socket);
  }

  void respond(int socket) {
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request;
    modbus_set_socket(context_.get(), socket);
    const int size = modbus_receive(context_.get(), request.data());
    if (size > 0) {
      modbus_reply(context_.get(), request.data(), size, mapping_.get());
    } else if (size < 0) {
      FD_CLR(socket, &open_);
      close(socket);
    }
  }

  Context context_{modbus_new_tcp("127.0.0.1", 0)};
  Mapping mapping_{modbus_mapping_new(0, 0, cbcan::regmap::kRegisterFileWords, 0)};
  int listener_ = -1;
  int last_ = -1;
  fd_set open_{};
};

}  // namespace

int main() {
  BareServer server;
  if (!server.listen()) {
    std::perror("bare_server: cannot listen on 127.0.0.1");
    return 3;
  }
  while (true)
    server.serve();
}

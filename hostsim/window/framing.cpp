// SPDX-License-Identifier: MIT
#include "window/framing.hpp"

#include <modbus.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "cbcan/window.hpp"

namespace cbcan::window {

static_assert(kLongestFrame == MODBUS_MAX_ADU_LENGTH);

/// libmodbus reads from a pair of sockets what a Connection has received, with the shortest time-out that it
/// takes. From the descriptor itself it cannot: what it has read of an incomplete frame it forgets, and its
/// select() takes no descriptor from FD_SETSIZE on.
Framing::Framing(_modbus* context) : context_(context, modbus_free) {
  if (context == nullptr || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair_.data()) != 0)
    throw Error(Error::Cause::kNoDescriptor, std::strerror(errno));
  modbus_set_response_timeout(context, 0, 1);
  modbus_set_byte_timeout(context, 0, 0);
  if (pair_[0] < FD_SETSIZE) return;
  for (const int socket : pair_)
    ::close(socket);
  throw Error(Error::Cause::kNoDescriptor,
              "libmodbus needs a descriptor below 1024, and none is free; close some");
}

Framing::~Framing() {
  for (const int socket : pair_)
    ::close(socket);
}

bool Framing::send(int descriptor, Bytes request) {
  modbus_set_socket(context_.get(), descriptor);
  modbus_set_slave(context_.get(), request.front());
  modbus_flush(context_.get());
  return modbus_send_raw_request(context_.get(), request.data(), static_cast<int>(request.size())) >= 0;
}

Framing::Bytes Framing::response_in(Bytes received) {
  if (received.empty()) return {};
  modbus_set_socket(context_.get(), pair_[0]);
  ::send(pair_[1], received.data(), received.size(), 0);
  const int size = modbus_receive_confirmation(context_.get(), frame_.data());
  const auto whole = static_cast<std::size_t>(size);
  if (size <= 0 || whole != received.size()) {
    ::recv(pair_[0], frame_.data(), frame_.size(), MSG_DONTWAIT);  // what libmodbus has left
    return {};
  }
  const auto header = static_cast<std::size_t>(modbus_get_header_length(context_.get()));
  const std::size_t checksum = header == 1 ? 2 : 0;
  return Bytes(frame_).subspan(header - 1, whole - checksum - (header - 1));
}

}  // namespace cbcan::window

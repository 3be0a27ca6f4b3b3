// SPDX-License-Identifier: MIT
#include "io/can/beacon.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

namespace cbcan::io {

namespace {

constexpr Time kEvery = 3 * kSecond;

bool is_any(const text::ListenAddress& address) {
  return address.host == "0.0.0.0" || address.host == "::";
}

std::string host_name() {
  std::array<char, 65> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "localhost";
}

}  // namespace

Beacon::Beacon(const text::ListenAddress& to, const text::ListenAddress& server, Warn warn)
    : where_("socketcand-beacon " + text::to_string(to) + ": "), warn_(std::move(warn)) {
  const SocketAddress address = looked_up(where_, to);
  socket_ = datagram_socket(address);
  const int on = 1;
  if (!socket_ || setsockopt(socket_.get(), SOL_SOCKET, SO_BROADCAST, &on, sizeof on) != 0 ||
      connect(socket_.get(), address.get(), address.size) != 0)
    throw EnvironmentError(where_ + reason(errno) + "; give it the broadcast address of a network");
  const auto own = own_address(socket_.get());
  const std::string& host = is_any(server) && own ? own->host : server.host;
  text_ = fmt::format(
      "<CANBeacon name=\"{}\" type=\"SocketCAN\" description=\"cbcan-sim\">\n"
      "<URL>can://{}</URL><Bus name=\"can0\"/></CANBeacon>",
      host_name(), text::to_string(text::ListenAddress{host, server.port}));
}

void Beacon::poll(Time now) {
  if (now < next_) return;
  next_ = now + kEvery;
  // A program on this machine that did not listen the last time: that is told now, instead of sending.
  bool sent = send(socket_.get(), text_.data(), text_.size(), 0) >= 0;
  if (!sent && errno == ECONNREFUSED) sent = send(socket_.get(), text_.data(), text_.size(), 0) >= 0;
  if (sent || errno == ECONNREFUSED) return;
  if (!std::exchange(failed_, true)) warn_(where_ + reason(errno) + "; it is tried again every 3 s");
}

}  // namespace cbcan::io

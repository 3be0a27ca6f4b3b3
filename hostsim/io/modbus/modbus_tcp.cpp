// SPDX-License-Identifier: MIT
#include "io/modbus/modbus_tcp.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace cbcan::io {

struct ModbusTcp::Connection {
  explicit Connection(Descriptor accepted) : socket(std::move(accepted)) {}

  /// False also for a request that has not been read.
  bool is_idle() const {
    std::uint8_t byte = 0;
    return received == 0 && unsent.empty() && ::recv(socket.get(), &byte, 1, MSG_PEEK) <= 0;
  }

  Descriptor socket;
  std::uint32_t number = 0;
  std::uint64_t used = 0;  ///< uses_ at its last read
  std::string peer;
  std::size_t received = 0;
  Time deadline = kNever;            ///< of an incomplete request in the buffer
  std::vector<std::uint8_t> unsent;  ///< while not empty, nothing is read from this client
  std::array<std::uint8_t, protocols::ModbusServer::kMaxAdu> buffer;
};

ModbusTcp::ModbusTcp(Reactor& reactor, const ListenAddress& listen, protocols::ModbusServer& server,
                     Warn warn)
    : reactor_(reactor),
      server_(server),
      acceptor_(reactor, "modbus", {"", listen}, *this, std::move(warn)) {}

ModbusTcp::~ModbusTcp() {
  for (const auto& [fd, client] : connections_)
    reactor_.forget(fd);
}

void ModbusTcp::poll(Time now) {
  while (next_deadline() <= now)
    close_client(*connections_.at(deadlines_.begin()->second));
}

void ModbusTcp::adopt(Descriptor socket) {
  const int fd = socket.get();
  auto made = std::make_unique<Connection>(std::move(socket));
  reactor_.watch(fd, Reactor::kReadable | Reactor::kUrgent, [this, &client = *made](std::uint32_t) {
    if (!on_ready(client)) close_client(client);
  });
  constexpr int kLostAfterMs = 120'000;  // while a response is not acknowledged there is no keep-alive
  setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &kLostAfterMs, sizeof kLostAfterMs);
  made->used = ++uses_;
  made->number = server_.join(made->peer = peer_of(fd));
  connections_[fd] = std::move(made);
}

bool ModbusTcp::make_room() {
  Connection* first = nullptr;
  for (const auto& [fd, client] : connections_)
    if ((first == nullptr || client->used < first->used) && client->is_idle()) first = client.get();
  if (first != nullptr) close_client(*first);
  return first != nullptr;
}

void ModbusTcp::close_client(Connection& client) {
  set_deadline(client, kNever);
  server_.leave(client.number, client.peer);
  reactor_.forget(client.socket.get());
  connections_.erase(client.socket.get());
}

/// This and the functions below return false when the connection is to be closed. Flattened for speed: what a
/// request passes here is one function.
[[gnu::flatten]] bool ModbusTcp::on_ready(Connection& client) {
  if (client.unsent.empty()) return receive(client);
  return send(client, client.unsent) && (!client.unsent.empty() || advance(client));
}

/// One read per turn, of at most one buffer: the rest waits in the socket until the other clients have been
/// served.
inline bool ModbusTcp::receive(Connection& client) {
  const ssize_t count = ::recv(client.socket.get(), client.buffer.data() + client.received,
                               client.buffer.size() - client.received, 0);
  if (count <= 0) return count < 0 && is_temporary(errno);
  client.received += static_cast<std::size_t>(count);
  client.used = ++uses_;
  return advance(client);
}

bool ModbusTcp::advance(Connection& client) {
  const std::uint8_t* rest = client.buffer.data();
  while (client.unsent.empty()) {
    const std::size_t size = protocols::ModbusServer::request_size({rest, client.received});
    if (size == 0) return false;
    if (client.received < size) break;
    const Bytes response = server_.execute(client.number, {rest, size});
    if (response.empty() || !send(client, response)) return false;
    rest += size;
    client.received -= size;
  }
  if (client.received != 0) std::memmove(client.buffer.data(), rest, client.received);
  const bool half = client.received != 0 && client.unsent.empty();
  if (half || client.deadline != kNever)
    set_deadline(client, half ? reactor_.time() + kHalfRequestTimeout : kNever);
  return true;
}

/// Keeps what the connection has no room for.
inline bool ModbusTcp::send(Connection& client, Bytes bytes) {
  const ssize_t count = ::send(client.socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  const bool waited = !client.unsent.empty();
  if (!waited && count == static_cast<ssize_t>(bytes.size())) return true;
  if (count < 0 && !is_temporary(errno)) return false;
  const Bytes rest = bytes.subspan(count < 0 ? 0 : static_cast<std::size_t>(count));
  client.unsent = std::vector(rest.begin(), rest.end());
  if (waited != client.unsent.empty()) return true;
  return reactor_.change(client.socket.get(), waited ? Reactor::kReadable : Reactor::kWritable);
}

void ModbusTcp::set_deadline(Connection& client, Time deadline) {
  if (client.deadline == deadline) return;
  const int fd = client.socket.get();
  if (client.deadline != kNever) deadlines_.erase({client.deadline, fd});
  if (deadline != kNever) deadlines_.insert({deadline, fd});
  client.deadline = deadline;
}

}  // namespace cbcan::io

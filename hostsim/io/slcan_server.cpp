// SPDX-License-Identifier: MIT
#include "io/slcan_server.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <utility>

namespace cbcan::io {

namespace {

constexpr std::size_t kReadBytes = 4096;
constexpr int kSendBufferBytes = 64 * 1024;

/// Accepted sockets inherit these; a Unix socket does not know the first.
void prepare(int listener) {
  const int on = 1;
  setsockopt(listener, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  setsockopt(listener, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
  setsockopt(listener, SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
}

bool is_temporary(int error) {
  return error == EAGAIN || error == EINTR;
}

}  // namespace

struct SlcanServer::Connection {
  Connection(Descriptor accepted, std::unique_ptr<sim::SlcanAdapter> plugged_in)
      : socket(std::move(accepted)), adapter(std::move(plugged_in)) {}

  Descriptor socket;
  std::unique_ptr<sim::SlcanAdapter> adapter;
  std::uint32_t interest = Reactor::kReadable;
};

SlcanServer::SlcanServer(Reactor& reactor, sim::Bus& bus, const StreamAddress& address,
                         std::size_t most_unsent, OnQueued on_queued, Warn warn)
    : reactor_(reactor),
      bus_(bus),
      most_unsent_(most_unsent),
      on_queued_(std::move(on_queued)),
      listener_("slcan", address),
      acceptor_(
          reactor, listener_.socket(), "slcan " + to_string(listener_.address()),
          [this](Descriptor socket) { adopt(std::move(socket)); }, [this] { return clients(); },
          std::move(warn)) {
  prepare(listener_.socket());
}

SlcanServer::~SlcanServer() {
  for (const auto& [fd, client] : connections_)
    reactor_.forget(fd);
}

void SlcanServer::flush() {
  std::vector<Connection*> ended;
  for (const auto& [fd, client] : connections_)
    if (!send(*client)) ended.push_back(client.get());
  for (Connection* client : ended)
    close_client(*client);
}

SlcanServer::Counters SlcanServer::counters() const {
  Counters counters = counters_;
  for (const auto& [fd, client] : connections_)
    counters.lost += client->adapter->counters().lost;
  for (const auto& adapter : idle_)
    counters.lost += adapter->counters().lost;
  return counters;
}

void SlcanServer::adopt(Descriptor socket) {
  const int fd = socket.get();
  Connection& client = *(connections_[fd] = std::make_unique<Connection>(std::move(socket), take_adapter()));
  reactor_.watch(fd, Reactor::kReadable, [this, &client](std::uint32_t ready) {
    const bool writable_alone = ready == Reactor::kWritable;
    if ((!writable_alone && !receive(client)) || !send(client)) close_client(client);
  });
  ++counters_.connections;
}

void SlcanServer::close_client(Connection& client) {
  client.adapter->reset();
  idle_.push_back(std::move(client.adapter));
  reactor_.forget(client.socket.get());
  connections_.erase(client.socket.get());
}

std::unique_ptr<sim::SlcanAdapter> SlcanServer::take_adapter() {
  if (idle_.empty()) return std::make_unique<sim::SlcanAdapter>(bus_, on_queued_, most_unsent_);
  auto adapter = std::move(idle_.back());
  idle_.pop_back();
  return adapter;
}

/// One read per turn: what is left in the socket waits until the others have had theirs. False here and below
/// = the connection is to be closed.
bool SlcanServer::receive(Connection& client) {
  std::array<char, kReadBytes> characters;
  const ssize_t count = ::recv(client.socket.get(), characters.data(), characters.size(), 0);
  if (count <= 0) return count < 0 && is_temporary(errno);
  client.adapter->receive({characters.data(), static_cast<std::size_t>(count)});
  return true;
}

bool SlcanServer::send(Connection& client) {
  const std::string_view unsent = client.adapter->unsent();
  if (!unsent.empty()) {
    const ssize_t count = ::send(client.socket.get(), unsent.data(), unsent.size(), MSG_NOSIGNAL);
    if (count < 0 && !is_temporary(errno)) return false;
    if (count > 0) client.adapter->sent(static_cast<std::size_t>(count));
  }
  watch(client);
  return true;
}

void SlcanServer::watch(Connection& client) {
  const std::size_t unsent = client.adapter->unsent().size();
  const std::uint32_t interest = (unsent < sim::SlcanAdapter::kMostUnsent ? Reactor::kReadable : 0) |
                                 (unsent > 0 ? Reactor::kWritable : 0);
  if (interest == client.interest) return;
  reactor_.change(client.socket.get(), interest);
  client.interest = interest;
}

}  // namespace cbcan::io

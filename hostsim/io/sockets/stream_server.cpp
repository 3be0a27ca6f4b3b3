// SPDX-License-Identifier: MIT
#include "io/sockets/stream_server.hpp"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <utility>
#include <vector>

namespace cbcan::io {

namespace {

constexpr std::size_t kReadBytes = 4096;

bool is_temporary(int error) {
  return error == EAGAIN || error == EINTR;
}

}  // namespace

struct StreamServer::Connection {
  Connection(Descriptor accepted, std::unique_ptr<StreamSession> made)
      : socket(std::move(accepted)), session(std::move(made)) {}

  Descriptor socket;
  std::unique_ptr<StreamSession> session;
  std::uint32_t interest = Reactor::kReadable;
};

StreamServer::StreamServer(Reactor& reactor, std::string_view service, const StreamAddress& address,
                           MakeSession make, Warn warn)
    : reactor_(reactor),
      make_(std::move(make)),
      acceptor_(
          reactor, service, address, [this](Descriptor socket) { adopt(std::move(socket)); },
          [this] { return clients(); }, std::move(warn)) {}

StreamServer::~StreamServer() {
  for (const auto& [fd, client] : connections_)
    reactor_.forget(fd);
}

void StreamServer::flush() {
  std::vector<Connection*> ended;
  for (const auto& [fd, client] : connections_)
    if (!send(*client)) ended.push_back(client.get());
  for (Connection* client : ended)
    close(*client);
}

void StreamServer::adopt(Descriptor socket) {
  const int fd = socket.get();
  auto made = std::make_unique<Connection>(std::move(socket), make_());
  reactor_.watch(fd, Reactor::kReadable, [this, &client = *made](std::uint32_t ready) {
    const bool writable_alone = ready == Reactor::kWritable;
    if ((!writable_alone && !receive(client)) || !send(client)) close(client);
  });
  connections_[fd] = std::move(made);
  ++accepted_;
}

void StreamServer::close(Connection& client) {
  reactor_.forget(client.socket.get());
  connections_.erase(client.socket.get());
}

/// One read per turn: what is left in the socket waits until the others have had theirs. False here and below
/// = the connection is to be closed.
bool StreamServer::receive(Connection& client) {
  std::array<char, kReadBytes> characters;
  const ssize_t count = ::recv(client.socket.get(), characters.data(), characters.size(), 0);
  if (count <= 0) return count < 0 && is_temporary(errno);
  client.session->receive({characters.data(), static_cast<std::size_t>(count)});
  return true;
}

bool StreamServer::send(Connection& client) {
  const std::string_view unsent = client.session->unsent();
  if (!unsent.empty()) {
    const ssize_t count = ::send(client.socket.get(), unsent.data(), unsent.size(), MSG_NOSIGNAL);
    if (count < 0 && !is_temporary(errno)) return false;
    if (count > 0) client.session->sent(static_cast<std::size_t>(count));
  }
  return watch(client);
}

bool StreamServer::watch(Connection& client) {
  const std::size_t unsent = client.session->unsent().size();
  const std::uint32_t interest =
      (unsent < kMostUnsent && client.session->wants_more() ? Reactor::kReadable : 0) |
      (unsent > 0 ? Reactor::kWritable : 0);
  if (interest == client.interest) return true;
  client.interest = interest;
  return reactor_.change(client.socket.get(), interest);
}

}  // namespace cbcan::io

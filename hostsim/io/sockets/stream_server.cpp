// SPDX-License-Identifier: MIT
#include "io/sockets/stream_server.hpp"

#include <sys/socket.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>
#include <vector>

#include "io/serial/pseudo_terminal.hpp"

namespace cbcan::io {

namespace {

constexpr std::size_t kMostReadBytes = 4096;
constexpr std::size_t kFewestReadBytes = 32;
constexpr std::size_t kWorkPerTurn = 512 * 1024;  ///< bytes read, times those who may get them

}  // namespace

struct StreamServer::Connection {
  Connection(Descriptor accepted, std::unique_ptr<StreamSession> made)
      : socket(std::move(accepted)), session(std::move(made)) {}

  ssize_t read(char* characters, std::size_t size) const {
    return is_terminal ? ::read(socket.get(), characters, size) : ::recv(socket.get(), characters, size, 0);
  }
  ssize_t write(std::string_view text) const {
    return is_terminal ? ::write(socket.get(), text.data(), text.size())
                       : ::send(socket.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_EOR);
  }

  Descriptor socket;
  std::unique_ptr<StreamSession> session;
  std::uint32_t interest = Reactor::kReadable;
  bool is_terminal = false;
};

StreamServer::StreamServer(Reactor& reactor, std::string_view service, const StreamAddress& address,
                           MakeSession make, Warn warn)
    : reactor_(reactor), make_(std::move(make)), address_(address) {
  if (address.is_terminal)
    serve_terminal(service);
  else
    acceptor_.emplace(
        reactor, service, address, [this](Descriptor socket) { adopt(std::move(socket)); },
        [this] { return clients(); }, std::move(warn));
}

StreamServer::~StreamServer() {
  for (const auto& [fd, client] : connections_)
    reactor_.forget(fd);
}

void StreamServer::flush() {
  std::vector<Connection*> ended;
  for (const auto& [fd, client] : connections_) {
    if (client->session->unsent().empty() && !client->session->has_ended()) continue;
    if (!send(*client)) ended.push_back(client.get());
    reactor_.serve_urgent();
  }
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

/// That nobody has it open is an event once, where edges are asked for.
void StreamServer::serve_terminal(std::string_view service) {
  PseudoTerminal terminal(service, address_);
  const int fd = terminal.port.get();
  adopt(std::move(terminal.port));
  link_ = std::move(terminal.link);
  accepted_ = 0;
  Connection& client = *connections_.at(fd);
  client.is_terminal = true;
  client.interest |= Reactor::kEdge;
  reactor_.change(fd, client.interest);
}

void StreamServer::close(Connection& client) {
  const int fd = client.socket.get();
  if (client.is_terminal) {
    tcflush(fd, TCIOFLUSH);
    client.session = make_();
    ++accepted_;
    return;
  }
  reactor_.forget(fd);
  connections_.erase(fd);
}

/// What each of so many clients sends may go to all of them.
std::size_t StreamServer::read_bytes() const {
  return std::clamp(kWorkPerTurn / (clients() * clients()), kFewestReadBytes, kMostReadBytes);
}

/// One read per turn: what is left in the socket waits until the others have had theirs. False here and below
/// = the connection is to be closed.
bool StreamServer::receive(Connection& client) {
  std::array<char, kMostReadBytes> characters;
  const ssize_t count = client.read(characters.data(), read_bytes());
  if (count <= 0) return count < 0 && is_temporary(errno);
  client.session->receive({characters.data(), static_cast<std::size_t>(count)});
  return !client.is_terminal || reactor_.change(client.socket.get(), client.interest);  // there may be more
}

bool StreamServer::send(Connection& client) {
  StreamSession& session = *client.session;
  for (bool more = true; more && !session.unsent().empty();) {
    const std::size_t size = session.segment();
    const ssize_t count = client.write(session.unsent().substr(0, size));
    if (count < 0 && !is_temporary(errno)) return false;
    if (count > 0) session.sent(static_cast<std::size_t>(count));
    more = count == static_cast<ssize_t>(size);
  }
  return (!session.has_ended() || !session.unsent().empty()) && watch(client);
}

bool StreamServer::watch(Connection& client) {
  const std::size_t unsent = client.session->unsent().size();
  const std::uint32_t interest =
      (unsent < kMostUnsent && client.session->wants_more() ? Reactor::kReadable : 0) |
      (unsent > 0 ? Reactor::kWritable : 0) | (client.interest & Reactor::kEdge);
  if (interest == client.interest) return true;
  client.interest = interest;
  return reactor_.change(client.socket.get(), interest);
}

}  // namespace cbcan::io

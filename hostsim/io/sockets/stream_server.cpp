// SPDX-License-Identifier: MIT
#include "io/sockets/stream_server.hpp"

#include <sys/socket.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>
#include <vector>

#include "io/serial/serial_port.hpp"

namespace cbcan::io {

namespace {

constexpr std::size_t kMostReadBytes = 4096;
constexpr std::size_t kFewestReadBytes = 32;
constexpr std::size_t kWorkPerTurn = 512 * 1024;  ///< bytes read times clients that may get them

}  // namespace

struct StreamServer::Connection {
  Connection(Descriptor accepted, std::unique_ptr<StreamSession> made)
      : socket(std::move(accepted)), session(std::move(made)) {}

  ssize_t write(std::string_view text) const {
    if (is_pty && input_ended) return errno = EPIPE, -1;
    return is_pty ? ::write(socket.get(), text.data(), text.size())
                  : ::send(socket.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_EOR);
  }

  /// Everything that the client has sent has been executed and answered.
  bool is_done() const { return input_ended && !session->is_busy() && session->unsent().empty(); }

  Descriptor socket;
  std::unique_ptr<StreamSession> session;
  std::uint32_t interest = Reactor::kReadable;
  bool is_pty = false;
  bool input_ended = false;
};

StreamServer::StreamServer(Reactor& reactor, std::string_view service, const StreamAddress& address,
                           MakeSession make, Warn warn)
    : reactor_(reactor),
      make_([this, make = std::move(make)] {
        return protocols::without_browsers(make(), [this] { warn_of_browser(); });
      }),
      address_(address) {
  if (!address.is_pty) {
    acceptor_.emplace(reactor, service, address, static_cast<AcceptsClients&>(*this), std::move(warn));
    return;
  }
  PseudoTerminal terminal(service, address_);
  const int fd = terminal.port.get();
  adopt(std::move(terminal.port));
  link_ = std::move(terminal.link);
  Connection& client = *connections_.at(fd);
  client.is_pty = true;
  client.interest |= Reactor::kEdge;  // without a client it would be ready all the time
  reactor_.change(fd, client.interest);
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
    reactor_.poll_urgent();
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
}

/// Closes a client that no longer sends, and may no longer read.
bool StreamServer::make_room() {
  const auto found = std::ranges::find_if(
      connections_, [](const auto& entry) { return entry.second->input_ended && !entry.second->is_pty; });
  if (found == connections_.end()) return false;
  close(*found->second);
  return true;
}

void StreamServer::close(Connection& client) {
  const int fd = client.socket.get();
  if (client.is_pty) {
    tcflush(fd, TCIOFLUSH);
    client.session = make_();
    client.input_ended = false;
    return;
  }
  reactor_.forget(fd);
  connections_.erase(fd);
}

/// Decreases with the square of the number of clients: what each sends may go to all of them.
std::size_t StreamServer::read_bytes() const {
  return std::clamp(kWorkPerTurn / (clients() * clients()), kFewestReadBytes, kMostReadBytes);
}

/// One read per turn: the rest waits in the socket until the other clients have been served. False here and below
/// = the connection is to be closed.
bool StreamServer::receive(Connection& client) {
  std::array<char, kMostReadBytes> characters;
  const bool had_ended = client.input_ended;
  const ssize_t count = ::read(client.socket.get(), characters.data(), read_bytes());
  if (count < 0 && is_temporary(errno)) return true;
  client.input_ended = count == 0 || (count < 0 && client.is_pty);
  if (count == 0) client.session->end_input();
  if (count <= 0) return client.input_ended;
  if (had_ended) close(client);  // a terminal: these bytes are the next client's
  client.session->receive({characters.data(), static_cast<std::size_t>(count)});
  return !client.is_pty || reactor_.change(client.socket.get(), client.interest);  // there may be more
}

void StreamServer::warn_of_browser() {
  if (acceptor_ && !std::exchange(browser_reported_, true))
    acceptor_->warn("a client that speaks HTTP, as a browser does, is turned away; --http serves HTTP");
}

bool StreamServer::send(Connection& client) {
  StreamSession& session = *client.session;
  for (bool more = true; more && !session.unsent().empty();) {
    const std::size_t size = session.segment();
    ssize_t count = client.write(session.unsent().substr(0, size));
    if (count < 0 && !is_temporary(errno)) {
      if (!client.input_ended) return false;
      count = static_cast<ssize_t>(size);  // it has left; its input is still executed
    }
    if (count > 0) session.sent(static_cast<std::size_t>(count));
    more = count == static_cast<ssize_t>(size);
  }
  const bool ended = session.has_ended() && session.unsent().empty();
  return !ended && !client.is_done() && watch(client);
}

/// Edge-triggered once a client's input has ended, because it would be ready all the time.
bool StreamServer::watch(Connection& client) {
  const std::size_t unsent = client.session->unsent().size();
  const bool reads = unsent < StreamSession::kMostUnsent && client.session->wants_more() &&
                     (client.is_pty || !client.input_ended);
  const bool edge = client.is_pty || client.input_ended;
  const std::uint32_t interest =
      (reads ? Reactor::kReadable : 0) | (unsent > 0 ? Reactor::kWritable : 0) | (edge ? Reactor::kEdge : 0);
  if (interest == client.interest) return true;
  client.interest = interest;
  return reactor_.change(client.socket.get(), interest);
}

}  // namespace cbcan::io

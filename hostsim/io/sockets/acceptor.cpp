// SPDX-License-Identifier: MIT
#include "io/sockets/acceptor.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>

namespace cbcan::io {

namespace {

constexpr int kAcceptsPerTurn = 16;

Descriptor open_reserve() {
  return Descriptor(open("/dev/null", O_RDONLY | O_CLOEXEC));
}

Descriptor accept_client(int listener) {
  return Descriptor(accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

/// Accepted sockets inherit these; those of TCP have no effect on a Unix socket. A peer that has vanished is
/// noticed 60 + 6 * 10 s after its last byte.
void prepare_listener(int listener) {
  const int on = 1;
  const int bytes = Acceptor::kSendBufferBytes;
  setsockopt(listener, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  setsockopt(listener, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
  for (const auto& [option, value] : {std::pair{TCP_KEEPIDLE, 60}, {TCP_KEEPINTVL, 10}, {TCP_KEEPCNT, 6}})
    setsockopt(listener, IPPROTO_TCP, option, &value, sizeof value);
  setsockopt(listener, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
}

}  // namespace

Acceptor::Acceptor(Reactor& reactor, std::string_view service, const StreamAddress& address,
                   AcceptsClients& server, Warn warn)
    : reactor_(reactor),
      listener_(service, address),
      where_(std::string(service) + " " + to_string(listener_.address())),
      server_(server),
      warn_(std::move(warn)),
      reserve_(open_reserve()) {
  prepare_listener(listener_.socket());
  raise_descriptor_limit();
  reactor_.watch(listener_.socket(), Reactor::kReadable, [this](std::uint32_t) { accept_clients(); });
}

void Acceptor::accept_clients() {
  for (int i = 0; i < kAcceptsPerTurn; ++i) {
    if (server_.is_full()) {
      if (i != 0) return;  // it is called again if one more waits
      if (!server_.make_room()) return void(reactor_.change(listener_.socket(), 0));
    }
    Descriptor socket = accept_client(listener_.socket());
    if (socket) {
      hand_over(std::move(socket));
    } else if (errno == EMFILE || errno == ENFILE) {
      // Without a descriptor accept4() fails also if no client waits.
      if (i != 0 || (!server_.make_room() && !refuse_client())) return;
    } else if (errno != ECONNABORTED && errno != EINTR) {
      return;
    }
  }
}

/// A failure for one client closes only that one.
void Acceptor::hand_over(Descriptor socket) try {
  server_.adopt(std::move(socket));
  told_ = false;
} catch (const std::exception& error) {
  turned_away(std::string("a further client cannot be served: ") + error.what());
}

void Acceptor::turned_away(const std::string& why) {
  if (!told_) warn(why);
  told_ = true;
}

/// False: no client waits.
bool Acceptor::refuse_client() {
  reserve_.reset();
  const bool refused = static_cast<bool>(accept_client(listener_.socket()));
  reserve_ = open_reserve();
  if (!refused) return false;
  turned_away("no descriptor left for a further client (" + std::to_string(server_.clients()) +
              " are connected); raise the limit with `ulimit -n`");
  return true;
}

}  // namespace cbcan::io

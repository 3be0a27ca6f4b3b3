// SPDX-License-Identifier: MIT
#include "io/sockets/acceptor.hpp"

#include <fcntl.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>

namespace cbcan::io {

namespace {

constexpr int kAcceptsPerTurn = 64;

Descriptor open_reserve() {
  return Descriptor(open("/dev/null", O_RDONLY | O_CLOEXEC));
}

Descriptor accept_client(int listener) {
  return Descriptor(accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

}  // namespace

Acceptor::Acceptor(Reactor& reactor, int listener, std::string where, OnClient on_client,
                   std::function<std::size_t()> clients, Warn warn)
    : reactor_(reactor),
      listener_(listener),
      where_(std::move(where)),
      on_client_(std::move(on_client)),
      clients_(std::move(clients)),
      warn_(std::move(warn)),
      reserve_(open_reserve()) {
  raise_descriptor_limit();
  reactor_.watch(listener_, Reactor::kReadable, [this](std::uint32_t) { accept_clients(); });
}

Acceptor::~Acceptor() {
  reactor_.forget(listener_);
}

void Acceptor::accept_clients() {
  for (int i = 0; i < kAcceptsPerTurn; ++i) {
    Descriptor socket = accept_client(listener_);
    if (socket) {
      full_told_ = false;
      on_client_(std::move(socket));
    } else if (errno == EMFILE || errno == ENFILE) {
      if (!refuse_client()) return;
    } else if (errno != ECONNABORTED && errno != EINTR) {
      return;
    }
  }
}

/// False when there is nobody left to turn away.
bool Acceptor::refuse_client() {
  reserve_.reset();
  const bool refused = static_cast<bool>(accept_client(listener_));
  reserve_ = open_reserve();
  if (!refused) return false;
  ++refused_;
  if (!full_told_)
    warn_(where_ + ": no descriptor left for a further client (" + std::to_string(clients_()) +
          " are connected); raise the limit with `ulimit -n`");
  full_told_ = true;
  return true;
}

}  // namespace cbcan::io

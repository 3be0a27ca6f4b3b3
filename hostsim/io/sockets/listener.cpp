// SPDX-License-Identifier: MIT
#include "io/sockets/listener.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/text.hpp"

namespace cbcan::io {

namespace {

/// All addresses of a host, IPv4 before IPv6.
std::vector<SocketAddress> look_up(const std::string& where, const ListenAddress& address, int flags,
                                   const char* way_out) {
  addrinfo hints{};
  hints.ai_flags = flags | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const int error = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &list);
  if (error != 0) throw EnvironmentError(where + gai_strerror(error) + way_out);
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(list, freeaddrinfo);
  std::vector<SocketAddress> found;
  for (; list != nullptr; list = list->ai_next) {
    SocketAddress& made = found.emplace_back();
    made.size = list->ai_addrlen;
    std::memcpy(&made.storage, list->ai_addr, list->ai_addrlen);
  }
  std::stable_partition(found.begin(), found.end(),
                        [](const SocketAddress& entry) { return entry.get()->sa_family == AF_INET; });
  return found;
}

SocketAddress unix_address(const std::string& path) {
  SocketAddress address{.storage = {}, .size = sizeof(sockaddr_un)};
  auto& name = reinterpret_cast<sockaddr_un&>(address.storage);
  name.sun_family = AF_UNIX;
  path.copy(name.sun_path, sizeof name.sun_path - 1);
  return address;
}

Descriptor try_listen(const SocketAddress& address) {
  Descriptor socket = new_stream_socket(address);
  const int on = 1;
  if (socket) setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (!socket || bind(socket.get(), address.get(), address.size) != 0 || listen(socket.get(), SOMAXCONN) != 0)
    return {};
  return socket;
}

/// True: the file of a socket on which no program listens. Connecting to any other file is refused too, hence
/// the check of its type.
bool is_abandoned_socket(const std::string& path) {
  struct stat file {};
  if (lstat(path.c_str(), &file) != 0 || !S_ISSOCK(file.st_mode)) return false;
  const SocketAddress address = unix_address(path);
  return connect(new_stream_socket(address).get(), address.get(), address.size) != 0 && errno == ECONNREFUSED;
}

std::string way_out(const ListenAddress& address, int error) {
  switch (error) {
    case EACCES:
      return "permission denied: ports below 1024 need root; use " +
             to_string(ListenAddress{address.host, static_cast<std::uint16_t>(address.port + 1000)});
    case EADDRINUSE:
      return "address in use: another program listens there; stop it, or use " +
             to_string(ListenAddress{address.host, 0}) + " for any free port";
    case EADDRNOTAVAIL:
      return "not an address of this machine; `ip address` lists them, 0.0.0.0 is all of them";
    default: return reason(error);
  }
}

/// The socket's address by `ask`: getsockname() or getpeername().
std::optional<ListenAddress> address_by(int (*ask)(int, sockaddr*, socklen_t*), int socket) {
  SocketAddress address;
  address.size = sizeof address.storage;
  auto* const storage = reinterpret_cast<sockaddr*>(&address.storage);
  return ask(socket, storage, &address.size) == 0 ? address_of(address) : std::nullopt;
}

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

SocketAddress looked_up(const std::string& where, const ListenAddress& address) {
  return look_up(where, address, 0, "; write an IP address").front();
}

std::optional<ListenAddress> address_of(const SocketAddress& address) {
  std::array<char, NI_MAXHOST> host{};
  std::array<char, NI_MAXSERV> port{};
  if (getnameinfo(address.get(), address.size, host.data(), host.size(), port.data(), port.size(),
                  NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    return std::nullopt;
  return ListenAddress{host.data(), base::parse<std::uint16_t>(port.data()).value_or(0)};
}

std::string peer_of(int socket) {
  const auto peer = address_by(getpeername, socket);
  return peer ? to_string(*peer) : std::string();
}

Descriptor new_stream_socket(const SocketAddress& address) {
  return Descriptor(socket(address.get()->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
}

int take_error(int socket) {
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
  return error;
}

OwnFile::OwnFile(const std::string& where, std::string path, std::string_view does, const Condition& make,
                 const Condition& is_abandoned)
    : path_(std::move(path)) {
  bool made = make();
  if (!made && (errno == EADDRINUSE || errno == EEXIST)) {
    if (!is_abandoned())
      throw EnvironmentError(where + "in use: another program " + std::string(does) +
                             " there, or it is a file; write another path");
    unlink(path_.c_str());
    made = make();
  }
  if (!made) throw EnvironmentError(where + reason(errno) + "; write a path in a folder that can be written");
  file_ = identity();
}

OwnFile::~OwnFile() {
  if (!path_.empty() && identity() == file_) unlink(path_.c_str());
}

OwnFile::Identity OwnFile::identity() const {
  struct stat file {};
  std::error_code not_a_link;
  if (lstat(path_.c_str(), &file) != 0) return {};
  return {file.st_dev, file.st_ino, std::filesystem::read_symlink(path_, not_a_link)};
}

StreamListener::StreamListener(std::string_view service, const StreamAddress& address) : address_(address) {
  const std::string where = std::string(service) + " " + to_string(address) + ": ";
  if (const std::string& path = address.path; !path.empty()) {
    const auto make = [&] {
      socket_ = try_listen(unix_address(path));
      return static_cast<bool>(socket_);
    };
    file_ = OwnFile(where, path, "listens", make, [&] { return is_abandoned_socket(path); });
    return;
  }
  int error = 0;
  for (const SocketAddress& entry :
       look_up(where, address_.tcp, AI_PASSIVE, ": write an address of this machine, such as 127.0.0.1")) {
    socket_ = try_listen(entry);
    if (socket_) {
      const auto bound = address_by(getsockname, socket_.get());
      if (!bound) throw EnvironmentError("listening socket: " + reason(errno));
      address_.tcp = *bound;
      return;
    }
    if (error == 0) error = errno;
  }
  throw EnvironmentError(where + way_out(address_.tcp, error));
}

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

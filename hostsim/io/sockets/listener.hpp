// SPDX-License-Identifier: MIT
#pragma once

/// Addresses of stream sockets, and the sockets that listen on them and accept clients.

#include <sys/socket.h>
#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "base/address.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"

namespace cbcan::io {

using base::ListenAddress;
using base::StreamAddress;

/// An address in the kernel's format.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

/// The first of a host's addresses, IPv4 before IPv6, with the port. A name is looked up, which may block.
/// Throws EnvironmentError, its text beginning with `where`.
SocketAddress looked_up(const std::string& where, const ListenAddress& address);

/// The address with a numeric host; nullopt if it cannot be determined.
std::optional<ListenAddress> address_of(const SocketAddress& address);

/// The other end of a connected TCP socket as "HOST:PORT"; empty if it cannot be determined.
std::string peer_of(int socket);

/// A new non-blocking stream socket of the address's family; none if there is no descriptor left.
Descriptor new_stream_socket(const SocketAddress& address);

/// Takes a socket's pending error; 0 = none.
int take_error(int socket);

/// A file that this program has created; the destructor removes it unless another program has replaced it.
class OwnFile {
 public:
  using Condition = std::function<bool()>;

  OwnFile() = default;
  /// Calls `make`, which creates the file at `path` or sets errno; an abandoned file there is removed first.
  /// Throws EnvironmentError, its text beginning with `where`; another program "listens" or "serves" on a
  /// file in use.
  OwnFile(const std::string& where, std::string path, std::string_view does, const Condition& make,
          const Condition& is_abandoned);
  OwnFile(OwnFile&& other) noexcept : path_(std::exchange(other.path_, {})), file_(std::move(other.file_)) {}
  OwnFile& operator=(OwnFile&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(file_, other.file_);
    return *this;
  }
  ~OwnFile();

 private:
  using Identity = std::tuple<dev_t, ino_t, std::string>;

  /// A new link may get the inode number of a former one: the target distinguishes them.
  Identity identity() const;

  std::string path_;
  Identity file_;
};

/// A non-blocking listener; the destructor removes the file of its Unix socket.
class StreamListener {
 public:
  /// TCP: on the first of the host's addresses that is available, IPv4 before IPv6; a host name is looked up,
  /// which may block. An abandoned Unix socket is replaced; any other file is left unchanged. Throws
  /// EnvironmentError, its text beginning with `service` ("modbus") and the address.
  StreamListener(std::string_view service, const StreamAddress& address);

  int socket() const { return socket_.get(); }
  /// The address with the actual port instead of port 0.
  const StreamAddress& address() const { return address_; }

 private:
  StreamAddress address_;
  OwnFile file_;
  Descriptor socket_;
};

/// A server of accepted clients.
class AcceptsClients {
 public:
  /// Takes a client's socket, which is closed if this throws: non-blocking, with a send buffer of
  /// kSendBufferBytes and without delay for small responses.
  virtual void adopt(Descriptor socket) = 0;
  /// The number of clients, for the warning when some are refused.
  virtual std::size_t clients() const = 0;
  /// True: further clients wait until Acceptor::resume(), unless make_room() helps.
  virtual bool is_full() const { return false; }
  /// Closes a connection that is no longer used, to free its descriptor; false = there is none.
  virtual bool make_room() { return false; }

 protected:
  ~AcceptsClients() = default;
};

/// Listens, accepts clients, and refuses them when no descriptor is left: a client left waiting would wake
/// the reactor again and again.
class Acceptor {
 public:
  static constexpr int kSendBufferBytes = 64 * 1024;

  /// Starts listening, see StreamListener; reactor and server outlive this. Raises the limit of open
  /// descriptors.
  Acceptor(Reactor& reactor, std::string_view service, const StreamAddress& address, AcceptsClients& server,
           Warn warn);
  ~Acceptor() { reactor_.forget(listener_.socket()); }
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  const StreamListener& listener() const { return listener_; }

  /// Call it when a full server may have room again.
  void resume() { reactor_.change(listener_.socket(), Reactor::kReadable); }

  /// Writes a line about a client for the user.
  void warn(const std::string& what) const { warn_(where_ + ": " + what); }

 private:
  void accept_clients();
  void hand_over(Descriptor socket);
  void turned_away(const std::string& why);
  bool refuse_client();

  Reactor& reactor_;
  StreamListener listener_;
  std::string where_;
  AcceptsClients& server_;
  Warn warn_;
  Descriptor reserve_;  ///< closed to accept and refuse a client when no other is left
  bool told_ = false;
};

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#pragma once

/// Addresses of stream sockets, and the sockets that listen on them.

#include <sys/socket.h>
#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "base/address.hpp"
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

}  // namespace cbcan::io

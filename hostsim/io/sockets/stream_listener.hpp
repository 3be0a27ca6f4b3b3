// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "io/loop/descriptor.hpp"
#include "io/sockets/listen_address.hpp"

namespace cbcan::io {

/// Where a server of byte streams listens: TCP, or a socket in the file system.
struct StreamAddress {
  std::string path;   ///< of a Unix socket; empty = TCP
  ListenAddress tcp;  ///< of no meaning with a path

  friend bool operator==(const StreamAddress&, const StreamAddress&) = default;
};

/// Reads `unix:PATH`, else as parse_listen_address() with port 0 for none. Throws UsageError.
StreamAddress parse_stream_address(std::string_view text);

/// As parse_stream_address() reads it.
std::string to_string(const StreamAddress& address);

/// A non-blocking listener that takes the file of its Unix socket away when it goes.
class StreamListener {
 public:
  /// TCP: listen_tcp(). A Unix socket that nobody listens on any more is replaced; any other file is left
  /// alone. Throws EnvironmentError, its text beginning with `service`.
  StreamListener(std::string_view service, const StreamAddress& address);
  ~StreamListener();
  StreamListener(const StreamListener&) = delete;
  StreamListener& operator=(const StreamListener&) = delete;

  int socket() const { return socket_.get(); }
  /// With the port that port 0 became.
  const StreamAddress& address() const { return address_; }

 private:
  StreamAddress address_;
  Descriptor socket_;
};

}  // namespace cbcan::io

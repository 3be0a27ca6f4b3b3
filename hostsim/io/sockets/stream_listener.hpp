// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>
#include <utility>

#include "io/loop/descriptor.hpp"
#include "io/sockets/listen_address.hpp"

namespace cbcan::io {

using text::StreamAddress;

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
  std::pair<dev_t, ino_t> file_;  ///< of the Unix socket: somebody else's may be at its path by now
  Descriptor socket_;
};

}  // namespace cbcan::io

// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "io/loop/descriptor.hpp"
#include "io/sockets/listen_address.hpp"

namespace cbcan::io {

using text::StreamAddress;

/// A file that has been made here; taken away when this goes, unless it is somebody else's by now.
class OwnFile {
 public:
  using Identity = std::tuple<dev_t, ino_t, std::string>;

  OwnFile() = default;
  explicit OwnFile(std::string path);
  OwnFile(OwnFile&& other) noexcept : path_(std::exchange(other.path_, {})), file_(std::move(other.file_)) {}
  OwnFile& operator=(OwnFile&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(file_, other.file_);
    return *this;
  }
  ~OwnFile();

 private:
  std::string path_;
  Identity file_;
};

/// A non-blocking listener that takes the file of its Unix socket away when it goes.
class StreamListener {
 public:
  /// TCP: listen_tcp(). A Unix socket that nobody listens on any more is replaced; any other file is left
  /// alone. Throws EnvironmentError, its text beginning with `service`.
  StreamListener(std::string_view service, const StreamAddress& address);

  int socket() const { return socket_.get(); }
  /// With the port that port 0 became.
  const StreamAddress& address() const { return address_; }

 private:
  StreamAddress address_;
  OwnFile file_;
  Descriptor socket_;
};

}  // namespace cbcan::io

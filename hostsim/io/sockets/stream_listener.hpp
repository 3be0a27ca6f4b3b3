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

/// A file that this program has created; the destructor removes it unless another program has replaced it.
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

/// A non-blocking listener; the destructor removes the file of its Unix socket.
class StreamListener {
 public:
  /// TCP: listen_tcp(). An abandoned Unix socket is replaced; any other file is left unchanged. Throws
  /// EnvironmentError, its text beginning with `service`.
  StreamListener(std::string_view service, const StreamAddress& address);

  int socket() const { return socket_.get(); }
  /// With the actual port instead of port 0.
  const StreamAddress& address() const { return address_; }

 private:
  StreamAddress address_;
  OwnFile file_;
  Descriptor socket_;
};

}  // namespace cbcan::io

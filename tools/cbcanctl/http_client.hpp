// SPDX-License-Identifier: MIT
#pragma once

/// The little of HTTP/1.0 that it takes to read from a cbcan-sim of this network.

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "text/address.hpp"

namespace cbcan::tools {

class HttpGet {
 public:
  /// Asks for `path`, and has seen the head of a good response; throws ConnectionError, also for one with
  /// what the server complains about. `stop` is asked again and again.
  HttpGet(const text::ListenAddress& server, std::string_view path, const std::function<bool()>& stop);
  ~HttpGet();
  HttpGet(const HttpGet&) = delete;
  HttpGet& operator=(const HttpGet&) = delete;

  /// The next line, without its end; none = that was all, or `stop`.
  std::optional<std::string> line();

 private:
  void open(const text::ListenAddress& server);
  bool receive();

  std::function<bool()> stop_;
  int socket_ = -1;
  std::string received_;
};

}  // namespace cbcan::tools

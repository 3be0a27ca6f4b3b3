// SPDX-License-Identifier: MIT
#pragma once

/// What is common to every HTTP server here: requests that are refused, among them those of other sites, and
/// headers. Pure.

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>

#include "base/address.hpp"
#include "protocols/http_message.hpp"

namespace cbcan::protocols {

class HttpSite {
 public:
  using Handler = std::function<HttpResponse(const HttpRequest&)>;

  static constexpr std::size_t kMostBody = 64 * 1024;
  /// Headers of every response.
  static constexpr std::array<std::pair<const char*, const char*>, 3> kHeaders{{
      {"Cache-Control", "no-store"},
      {"X-Content-Type-Options", "nosniff"},
      {"Content-Security-Policy", "default-src 'self'; frame-ancestors 'none'"},
  }};

  /// `name`: the host as configured; `address`: where it is served. `write`: POST is served even if other
  /// machines can reach the address.
  HttpSite(std::string name, base::ListenAddress address, bool write, Handler handle);

  bool may_write() const { return may_write_; }

  /// `too_long`: the body has more than kMostBody bytes, and is not complete.
  HttpResponse respond(const HttpRequest& request, bool too_long) const;

 private:
  /// Empty = not refused.
  std::string refusal(const HttpRequest& request) const;

  std::string name_;
  base::ListenAddress address_;
  bool may_write_;
  Handler handle_;
};

}  // namespace cbcan::protocols

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

struct HttpSite {
  using Handler = std::function<HttpResponse(const HttpRequest&)>;

  static constexpr std::size_t kMostBody = 64 * 1024;
  /// Headers of every response.
  static constexpr std::array<std::pair<const char*, const char*>, 3> kHeaders{{
      {"Cache-Control", "no-store"},
      {"X-Content-Type-Options", "nosniff"},
      {"Content-Security-Policy", "default-src 'self'; frame-ancestors 'none'"},
  }};

  bool may_write() const;

  /// `too_long`: the body has more than kMostBody bytes, and is not complete.
  HttpResponse respond(const HttpRequest& request, bool too_long) const;

  std::string name;             ///< the host as configured
  base::ListenAddress address;  ///< where it is served
  bool write;                   ///< POST is served even if other machines can reach the address
  Handler handle;
};

}  // namespace cbcan::protocols

// SPDX-License-Identifier: MIT
#pragma once

/// What is common to every HTTP server here: requests that are refused, among them those of other sites, and
/// headers. Requests and responses are exchanged between the connection and the API (hostsim/web). Pure.

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "base/address.hpp"
#include "base/buffer.hpp"
#include "cbcan/time.hpp"

namespace cbcan::protocols {

struct HttpRequest {
  std::string method;  ///< GET or POST
  std::string path;
  std::map<std::string, std::string, std::less<>> query{};
  std::string body{};
  // Headers; empty = absent.
  std::string last_event_id{};  ///< of an EventSource that reconnects
  std::string host{};
  std::string origin{};
};

/// A body that is produced piece by piece.
class HttpStream {
 public:
  virtual ~HttpStream() = default;
  /// Appends what is available, slightly more than kMostUnsent at most; false = the body is complete.
  virtual bool fill(base::Buffer& to) = 0;
  /// fill() may have something.
  virtual bool has_news() const = 0;
  /// Text that is sent to detect a client that has left; may be empty.
  virtual std::string_view keep_alive() const { return {}; }
  /// Between two calls of fill() that find something new.
  virtual Time interval() const { return 20 * kMillisecond; }
  /// A long answer: fill() is called in each turn until it ends, also when it has appended nothing.
  virtual bool is_answer() const { return false; }

  /// Small enough that the turns of a hundred streams do not delay the rest of the loop.
  static constexpr std::size_t kMostUnsent = 8 * 1024;
};

struct HttpResponse {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body = {};
  std::unique_ptr<HttpStream> stream = {};  ///< instead of the body
  bool closes = false;                      ///< the connection afterwards
};

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

// SPDX-License-Identifier: MIT
#pragma once

/// Requests and responses of HTTP, between who has the socket (hostsim/io) and who has the answer
/// (hostsim/web).

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace cbcan::adapters {

struct HttpRequest {
  std::string method;  ///< GET or POST
  std::string path;
  std::map<std::string, std::string, std::less<>> query;
  std::string body;
  std::string last_event_id;  ///< of an EventSource that connects again
};

/// A body that comes bit by bit.
class HttpStream {
 public:
  virtual ~HttpStream() = default;
  /// Appends what there is by now, a little more than kMostUnsent at most; false = that was the end.
  virtual bool fill(std::string& text) = 0;
  /// fill() may have something.
  virtual bool has_news() const = 0;
  /// What shows whether the client is still there; may be empty.
  virtual std::string_view keep_alive() const { return {}; }

  /// So little that the turns of a hundred streams do not keep the others of the loop waiting.
  static constexpr std::size_t kMostUnsent = 8 * 1024;
};

struct HttpResponse {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body = {};
  std::unique_ptr<HttpStream> stream = {};  ///< in the place of the body
};

}  // namespace cbcan::adapters

// SPDX-License-Identifier: MIT
#pragma once

/// An HTTP server by libmicrohttpd in the caller's loop: no thread, nothing blocks, and what clients may cost
/// is bounded. It knows no resources; it refuses what comes from other sites: requests for a host name that
/// is not this machine's (DNS rebinding), and requests of pages from elsewhere (Origin).

#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "adapters/http_message.hpp"
#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/sockets/acceptor.hpp"

struct MHD_Connection;
struct MHD_Daemon;

namespace cbcan::io {

class HttpServer final : private AcceptsClients {
 public:
  static constexpr std::size_t kMostBody = 64 * 1024;
  static constexpr unsigned kMostClients = 128;  ///< more wait until one has gone
  using Handler = std::function<adapters::HttpResponse(const adapters::HttpRequest&)>;

  /// Listens at once; throws EnvironmentError when it cannot. `handle` must not destroy the server. `write`:
  /// POST is served though other machines reach the address.
  HttpServer(Reactor& reactor, const text::ListenAddress& listen, bool write, Handler handle, Warn warn);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// With the real port.
  const text::ListenAddress& address() const { return acceptor_.listener().address().tcp; }
  bool may_write() const { return may_write_; }
  /// Responses that go on.
  std::size_t streams() const { return streams_.size(); }

  /// Serves a connected, non-blocking stream socket that somebody else has accepted.
  void adopt(Descriptor socket) override;

  /// Streams get what is new, but not more often than every 20 ms. To be called once per turn, and at
  /// next_deadline(). `now` is Reactor::now()'s.
  void poll(Time now);
  Time next_deadline() const;

 private:
  struct Exchange;
  struct Live;
  struct Callbacks;

  std::size_t clients() const override;
  bool is_full() const override { return clients() >= kMostClients; }
  /// Whether one goes on.
  bool poll_streams(Time now);
  void make_way();
  std::string refusal(const adapters::HttpRequest& request, const std::string& host,
                      const std::string& origin) const;

  Reactor& reactor_;
  std::string name_;  ///< of the address, as it was given
  Acceptor acceptor_;
  bool may_write_;
  Handler handle_;
  std::vector<MHD_Connection*> connections_;
  std::list<Live*> streams_;
  Time look_at_ = 0;            ///< at streams: not before
  bool may_have_news_ = false;  ///< a stream, since the last look
  Time keep_alive_at_ = kNever;
  MHD_Daemon* daemon_ = nullptr;
};

}  // namespace cbcan::io

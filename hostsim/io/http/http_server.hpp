// SPDX-License-Identifier: MIT
#pragma once

/// An HTTP server on libmicrohttpd in the caller's loop: no thread, nothing blocks, and the memory that
/// clients use is bounded. What it serves and refuses is protocols/http_site.hpp's.

#include <cstddef>
#include <list>
#include <memory>

#include "cbcan/time.hpp"
#include "io/loop/reactor.hpp"
#include "io/sockets/listener.hpp"
#include "protocols/http_site.hpp"

struct MHD_Connection;
struct MHD_Daemon;

namespace cbcan::io {

class HttpServer final : private AcceptsClients {
 public:
  /// A further one closes the connection that has been idle for longest; without one it waits.
  static constexpr unsigned kMostClients = 1024;

  /// Starts listening; throws EnvironmentError on failure. `handle` must not destroy the server. `write`: see
  /// HttpSite.
  HttpServer(Reactor& reactor, const base::ListenAddress& listen, bool write,
             protocols::HttpSite::Handler handle, Warn warn);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// The address with the real port.
  const base::ListenAddress& address() const { return acceptor_.listener().address().tcp; }
  bool may_write() const { return site_.may_write(); }
  /// Streamed responses in progress.
  std::size_t streams() const { return streams_.size(); }

  /// Serves a connected, non-blocking stream socket.
  void adopt(Descriptor socket) override;

  /// Sends new data on streams, at their intervals. To be called once per turn, and at next_deadline().
  /// `now` is Reactor::now()'s.
  void poll(Time now);
  Time next_deadline() const;

 private:
  struct Client {
    MHD_Connection* connection;
    Time idle_since;  ///< kNever: a request is in progress
  };
  struct Exchange;
  struct Live;
  struct Callbacks;

  std::size_t clients() const override { return clients_.size(); }
  bool is_full() const override { return clients() >= kMostClients; }
  bool make_room() override;
  bool poll_streams(Time now, bool looks);
  bool send_news(Live& live, Time now);
  void let_in();
  void make_way();

  Reactor& reactor_;
  Acceptor acceptor_;
  protocols::HttpSite site_;
  std::list<Client> clients_;
  std::list<Live> streams_;
  Time now_ = 0;                ///< of the last poll
  Time look_at_ = 0;            ///< streams are not polled before
  bool may_have_news_ = false;  ///< a stream may have new data since it was polled
  bool is_answering_ = false;   ///< an answer waits for its next turn
  bool has_queue_ = false;      ///< a client waits for room
  Time keep_alive_at_ = kNever;
  std::unique_ptr<MHD_Daemon, void (*)(MHD_Daemon*)> daemon_;
};

}  // namespace cbcan::io

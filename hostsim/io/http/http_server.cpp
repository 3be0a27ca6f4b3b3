// SPDX-License-Identifier: MIT
#include "io/http/http_server.hpp"

#include <microhttpd.h>
#include <poll.h>
#include <strings.h>
#include <sys/socket.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "io/loop/system.hpp"

namespace cbcan::io {

namespace {

constexpr Time kLongestInterval = kSecond;
constexpr Time kKeepAlive = 5 * kSecond;
constexpr unsigned kSilentForSeconds = 30;  ///< a client with an incomplete request
constexpr std::size_t kMemoryPerConnection = 32 * 1024;

int socket_of(MHD_Connection* connection) {
  return MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
}

/// True: the client no longer sends, and may no longer read.
bool has_left(MHD_Connection* connection) {
  pollfd socket{socket_of(connection), POLLRDHUP, 0};
  return ::poll(&socket, 1, 0) > 0;
}

std::string header(MHD_Connection* connection, const char* name) {
  const char* const value = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
  return value == nullptr ? "" : value;
}

}  // namespace

/// One request, until it has been answered.
struct HttpServer::Exchange {
  protocols::HttpRequest request;
  bool is_too_long = false;
  bool is_read = true;  ///< false: out of memory
};

/// A stream and its client.
struct HttpServer::Live {
  HttpServer& server;
  std::unique_ptr<protocols::HttpStream> stream;
  MHD_Connection* connection;
  const bool is_answer = stream->is_answer();
  base::Buffer text{};
  std::size_t sent = 0;  ///< characters of it
  Time sent_at = Reactor::now();
  bool has_more = true;  ///< the last fill was full
  bool ended = false;
  bool broken = false;  ///< ended too early
  bool suspended = false;

  std::string_view unsent() const { return base::view(text, sent); }
  void fill() {
    if (!unsent().empty() || ended) return;
    text.clear();
    sent = 0;
    try {
      ended = !stream->fill(text);
      has_more = is_answer || text.size() >= protocols::HttpStream::kMostUnsent;
    } catch (const std::exception&) {
      ended = broken = true;
    }
  }
};

struct HttpServer::Callbacks {
  static MHD_Result on_query(void* into, MHD_ValueKind /*kind*/, const char* key, const char* value) {
    auto& exchange = *static_cast<Exchange*>(into);
    try {
      exchange.request.query[key] = value == nullptr ? "" : value;
    } catch (const std::exception&) {
      exchange.is_read = false;
    }
    return exchange.is_read ? MHD_YES : MHD_NO;
  }

  static MHD_Result count_lengths(void* into, MHD_ValueKind /*kind*/, const char* key,
                                  const char* /*value*/) {
    *static_cast<int*>(into) += strcasecmp(key, MHD_HTTP_HEADER_CONTENT_LENGTH) == 0 ? 1 : 0;
    return MHD_YES;
  }

  /// A second length could hide a request in the body of this one.
  static bool has_two_lengths(MHD_Connection* connection) {
    int lengths = 0;
    MHD_get_connection_values(connection, MHD_HEADER_KIND, count_lengths, &lengths);
    return lengths > 1;
  }

  static MHD_Result on_access(void* self, MHD_Connection* connection, const char* url, const char* method,
                              const char* /*version*/, const char* data, size_t* size, void** kept) try {
    auto& server = *static_cast<HttpServer*>(self);
    auto* exchange = static_cast<Exchange*>(*kept);
    if (exchange == nullptr) {
      client_of(connection).idle_since = kNever;
      if (has_two_lengths(connection)) return MHD_NO;
      *kept = new Exchange{{.method = method, .path = url}};
      return MHD_YES;
    }
    if (*size != 0) {
      exchange->is_too_long =
          exchange->is_too_long || exchange->request.body.size() + *size > protocols::HttpSite::kMostBody;
      if (!exchange->is_too_long) exchange->request.body.append(data, *size);
      *size = 0;
      return MHD_YES;
    }
    return respond(server, connection, *exchange);
  } catch (const std::exception&) {  // must not pass through the library; the connection is closed
    return MHD_NO;
  }

  static void on_completed(void* self, MHD_Connection* connection, void** kept,
                           MHD_RequestTerminationCode /*why*/) {
    delete static_cast<Exchange*>(*kept);
    *kept = nullptr;
    client_of(connection).idle_since = Reactor::now();
    static_cast<HttpServer*>(self)->let_in();
  }

  static Client& client_of(MHD_Connection* connection) {
    return *static_cast<Client*>(
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT)->socket_context);
  }

  static void on_connection(void* self, MHD_Connection* connection, void** kept,
                            MHD_ConnectionNotificationCode what) {
    auto& server = *static_cast<HttpServer*>(self);
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
      server.clients_.back().connection = connection;
      *kept = &server.clients_.back();
      return;
    }
    std::erase_if(server.clients_, [&](const Client& client) { return client.connection == connection; });
    server.let_in();
  }

  static MHD_Result respond(HttpServer& server, MHD_Connection* connection, Exchange& exchange) {
    protocols::HttpRequest& request = exchange.request;
    MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, on_query, &exchange);
    if (!exchange.is_read) return MHD_NO;
    request.host = header(connection, "Host");
    request.origin = header(connection, "Origin");
    request.last_event_id = header(connection, "Last-Event-ID");
    protocols::HttpResponse response = server.site_.respond(request, exchange.is_too_long);
    const std::unique_ptr<MHD_Response, void (*)(MHD_Response*)> made(
        response.stream ? stream(server, connection, std::move(response.stream))
                        : MHD_create_response_from_buffer(response.body.size(), response.body.data(),
                                                          MHD_RESPMEM_MUST_COPY),
        MHD_destroy_response);
    const auto has = [&made](const char* name, const char* value) {
      return made && MHD_add_response_header(made.get(), name, value) == MHD_YES;
    };
    const bool whole =
        has("Content-Type", response.type.c_str()) && (!response.closes || has("Connection", "close")) &&
        std::ranges::all_of(protocols::HttpSite::kHeaders,
                            [&has](const auto& header) { return has(header.first, header.second); });
    return whole ? MHD_queue_response(connection, response.status, made.get()) : MHD_NO;
  }

  static MHD_Response* stream(HttpServer& server, MHD_Connection* connection,
                              std::unique_ptr<protocols::HttpStream> stream) {
    server.streams_.push_back({server, std::move(stream), connection});
    MHD_Response* const made = MHD_create_response_from_callback(
        MHD_SIZE_UNKNOWN, protocols::HttpStream::kMostUnsent, on_read, &server.streams_.back(), on_free);
    if (made == nullptr) server.streams_.pop_back();
    return made;
  }

  static ssize_t on_read(void* self, std::uint64_t /*position*/, char* to, size_t most) {
    auto& live = *static_cast<Live*>(self);
    if (live.has_more) live.fill();
    if (live.unsent().empty()) {
      if (live.broken) return MHD_CONTENT_READER_END_WITH_ERROR;
      if (live.ended) return MHD_CONTENT_READER_END_OF_STREAM;
      MHD_suspend_connection(live.connection);
      live.suspended = true;
      live.server.is_answering_ |= live.is_answer;
      live.server.look_at_ = earlier(live.server.look_at_, live.server.now_ + live.stream->interval());
      return 0;
    }
    const std::size_t count = live.unsent().copy(to, most);
    live.sent += count;
    live.sent_at = Reactor::now();
    return static_cast<ssize_t>(count);
  }

  static void on_free(void* self) {
    auto& streams = static_cast<Live*>(self)->server.streams_;
    streams.remove_if([self](const Live& live) { return &live == self; });
  }
};

HttpServer::HttpServer(Reactor& reactor, const base::ListenAddress& listen, bool write,
                       protocols::HttpSite::Handler handle, Warn warn)
    : reactor_(reactor),
      acceptor_(reactor, "http", {"", listen}, *this, std::move(warn)),
      site_{listen.host, address(), write, std::move(handle)},
      daemon_(MHD_start_daemon(MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_NO_LISTEN_SOCKET, 0,
                               nullptr, nullptr, Callbacks::on_access, this, MHD_OPTION_NOTIFY_COMPLETED,
                               Callbacks::on_completed, this, MHD_OPTION_NOTIFY_CONNECTION,
                               Callbacks::on_connection, this, MHD_OPTION_CONNECTION_LIMIT, kMostClients,
                               MHD_OPTION_CONNECTION_TIMEOUT, kSilentForSeconds,
                               MHD_OPTION_CONNECTION_MEMORY_LIMIT, kMemoryPerConnection, MHD_OPTION_END),
              MHD_stop_daemon) {
  if (!daemon_) throw EnvironmentError("http " + to_string(listen) + ": it cannot be served");
  const int epoll = MHD_get_daemon_info(daemon_.get(), MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
  reactor_.watch(epoll, Reactor::kReadable, [this](std::uint32_t) { MHD_run(daemon_.get()); });
}

/// The library closes a socket that it does not accept.
void HttpServer::adopt(Descriptor socket) {
  const sockaddr_storage nobody{};
  clients_.push_back({nullptr, Reactor::now()});  // here: no exception may pass through the library
  if (MHD_add_connection(daemon_.get(), socket.release(), reinterpret_cast<const sockaddr*>(&nobody),
                         sizeof nobody) == MHD_YES)
    return;
  std::erase_if(clients_, [](const Client& client) { return client.connection == nullptr; });
  throw EnvironmentError("there is no memory for it");
}

/// The daemon must not be stopped with suspended connections.
HttpServer::~HttpServer() {
  for (Live& live : streams_) {
    live.ended = true;
    if (std::exchange(live.suspended, false)) MHD_resume_connection(live.connection);
  }
  MHD_run(daemon_.get());
  reactor_.forget(MHD_get_daemon_info(daemon_.get(), MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd);
}

/// The library does not report that resumed connections have something to do.
void HttpServer::poll(Time now) {
  now_ = now;
  const bool looks = now >= look_at_;
  const bool resumed = (looks || is_answering_) && poll_streams(now, looks);
  may_have_news_ |= !looks;
  MHD_UNSIGNED_LONG_LONG left = 0;
  if (resumed || (MHD_get_timeout(daemon_.get(), &left) == MHD_YES && left == 0)) MHD_run(daemon_.get());
}

/// Closes the connections of clients that left during a request or a stream, for clients that wait.
void HttpServer::make_way() {
  for (const Client& client : clients_)
    if (has_left(client.connection)) ::shutdown(socket_of(client.connection), SHUT_RDWR);
  for (Live& live : streams_)
    if (live.suspended && has_left(live.connection)) live.ended = live.broken = true;
}

bool HttpServer::make_room() {
  const auto first = std::ranges::min_element(clients_, {}, &Client::idle_since);
  has_queue_ = first == clients_.end() || first->idle_since == kNever;
  if (has_queue_) return false;
  first->idle_since = kNever;
  ::shutdown(socket_of(first->connection), SHUT_RDWR);
  MHD_run(daemon_.get());
  return true;
}

/// Serves clients that wait, as there may be room for them.
void HttpServer::let_in() {
  if (std::exchange(has_queue_, false)) acceptor_.resume();
}

/// True: a connection has been resumed. Between looks only answers go on.
bool HttpServer::poll_streams(Time now, bool looks) {
  if (looks) {
    if (has_queue_) make_way();
    may_have_news_ = has_queue_;
    keep_alive_at_ = kNever;
    look_at_ = now + kLongestInterval;
  }
  is_answering_ = false;
  bool resumed = false;
  for (Live& live : streams_) {
    if (!live.suspended || !(looks || live.is_answer)) continue;
    resumed |= send_news(live, now);
    look_at_ = earlier(look_at_, now + live.stream->interval());
  }
  return resumed;
}

/// True: the connection has been resumed.
bool HttpServer::send_news(Live& live, Time now) {
  if (live.stream->has_news()) live.fill();
  may_have_news_ = may_have_news_ || live.stream->has_news();
  if (live.unsent().empty() && !live.ended) {
    const std::string_view keep_alive = live.stream->keep_alive();
    const Time due = keep_alive.empty() ? kNever : live.sent_at + kKeepAlive;
    if (now < due) {
      keep_alive_at_ = earlier(keep_alive_at_, due);
      is_answering_ |= live.is_answer;
      return false;
    }
    live.text.clear();
    base::append(live.text, keep_alive);
    live.sent = 0;
  }
  live.suspended = false;
  MHD_resume_connection(live.connection);
  return true;
}

Time HttpServer::next_deadline() const {
  if (is_answering_) return 0;
  const bool waits = !streams_.empty() || has_queue_;
  Time next = !waits ? kNever : may_have_news_ ? look_at_ : keep_alive_at_;
  MHD_UNSIGNED_LONG_LONG left = 0;
  if (MHD_get_timeout(daemon_.get(), &left) == MHD_YES)
    next = earlier(next, Reactor::now() + left * kMillisecond);
  return next;
}

}  // namespace cbcan::io

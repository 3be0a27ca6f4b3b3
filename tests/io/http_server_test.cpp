// SPDX-License-Identifier: MIT
// The HTTP server as its clients see it, byte by byte over loopback.

#include "io/http/http_server.hpp"

#include "io/loop/system.hpp"
#include "io/stream_client.hpp"
#include "io/turns.hpp"

namespace cbcan::io {
namespace {

struct Web {
  explicit Web(const base::ListenAddress& listen = {"127.0.0.1", 0}, bool write = false)
      : server(
            reactor, listen, write, [this](const protocols::HttpRequest& request) { return handle(request); },
            [](const std::string&) {}) {}

  protocols::HttpResponse handle(const protocols::HttpRequest& request) {
    requests.push_back(request);
    return respond(request);
  }
  void turn() {
    server.poll(Reactor::now());
    reactor.poll(0);
  }
  template <typename Done>
  void until(Done done) {
    io::test::turn_until([this] { turn(); }, done);
  }
  std::string host() const { return "127.0.0.1:" + std::to_string(server.address().port); }
  /// Turns until the server has closed the connection.
  std::string ask(const std::string& method_and_path, const std::string& headers = "",
                  const std::string& body = "") {
    return ask_as(host(), method_and_path, headers, body);
  }
  std::string ask_as(const std::string& as, const std::string& method_and_path,
                     const std::string& headers = "", const std::string& body = "") {
    StreamClient client(StreamAddress{"", {"127.0.0.1", server.address().port}});
    const std::string length = body.empty() ? "" : "Content-Length: " + std::to_string(body.size()) + "\r\n";
    client.send(method_and_path + " HTTP/1.1\r\n" + (as.empty() ? "" : "Host: " + as + "\r\n") +
                "Connection: close\r\n" + headers + length + "\r\n" + body);
    until([&] { return client.closed(); });
    return client.heard();
  }

  Reactor reactor;
  std::vector<protocols::HttpRequest> requests;
  std::function<protocols::HttpResponse(const protocols::HttpRequest&)> respond =
      [](const protocols::HttpRequest&) {
        return protocols::HttpResponse{200, "text/plain", "hello"};
      };
  HttpServer server;
};

std::string status(const std::string& response) {
  return response.substr(0, response.find("\r\n"));
}
std::string body(const std::string& response) {
  const std::size_t at = response.find("\r\n\r\n");
  return at == std::string::npos ? "no body" : response.substr(at + 4);
}
bool has(const std::string& response, const std::string& line) {
  return response.find("\r\n" + line + "\r\n") != std::string::npos;
}

TEST_CASE("http: a request as it comes to the handler, and its response") {
  Web web;
  const std::string response = web.ask("POST /a/b?x=1&empty&y=%20z", "Last-Event-ID: 17\r\n", "some body");
  CHECK(status(response) == "HTTP/1.1 200 OK");
  CHECK(body(response) == "hello");
  for (const char* line :
       {"Content-Type: text/plain", "Cache-Control: no-store", "X-Content-Type-Options: nosniff",
        "Content-Security-Policy: default-src 'self'; frame-ancestors 'none'", "Content-Length: 5"})
    CHECK(has(response, line));
  REQUIRE(web.requests.size() == 1);
  const protocols::HttpRequest& request = web.requests[0];
  CHECK(request.method == "POST");
  CHECK(request.path == "/a/b");
  CHECK(request.query ==
        std::map<std::string, std::string, std::less<>>{{"x", "1"}, {"empty", ""}, {"y", " z"}});
  CHECK(request.body == "some body");
  CHECK(request.last_event_id == "17");
  web.ask("GET /");
  CHECK(web.requests[1].method == "GET");
  CHECK(web.requests[1].last_event_id.empty());
  CHECK(web.requests[1].body.empty());
}

TEST_CASE("http: methods, bodies and exceptions") {
  Web web;
  CHECK(status(web.ask("PUT /", "", "x")) == "HTTP/1.1 405 Method Not Allowed");
  CHECK(web.requests.empty());
  const std::string most(64 * 1024, 'x');
  CHECK(status(web.ask("POST /", "", most)) == "HTTP/1.1 200 OK");
  CHECK(web.requests.at(0).body == most);
  const std::string refused = web.ask("POST /", "", most + "x");
  CHECK(status(refused).starts_with("HTTP/1.1 413"));
  CHECK(body(refused) == "a body of more than 64 KiB\n");
  CHECK(web.requests.size() == 1);
  web.respond = [](const protocols::HttpRequest&) -> protocols::HttpResponse {
    throw std::runtime_error("broken");
  };
  const std::string broken = web.ask("GET /");
  CHECK(status(broken) == "HTTP/1.1 500 Internal Server Error");
  CHECK(body(broken) == "broken\n");
}

TEST_CASE("http: other sites and other names of this machine are refused") {
  Web web;
  const auto allowed = [&](const std::string& host, const std::string& headers = "") {
    return status(web.ask_as(host, "GET /", headers)) == "HTTP/1.1 200 OK";
  };
  CHECK(allowed(web.host()));
  CHECK(allowed("localhost:80"));
  CHECK(allowed("[::1]:80"));
  CHECK(allowed("10.1.2.3"));
  CHECK(allowed(web.host(), "Origin: http://" + web.host() + "\r\n"));
  CHECK(body(web.ask_as("evil.example", "GET /")) ==
        "Host is evil.example: use the address of this machine\n");
  CHECK(body(web.ask("GET /", "Origin: http://evil.example\r\n")) ==
        "pages of http://evil.example may not ask here\n");
  CHECK(body(web.ask_as("a:b:c", "GET /")) == "a request without a Host header that can be read\n");
  CHECK(status(web.ask_as("evil.example", "GET /")) == "HTTP/1.1 403 Forbidden");
}

TEST_CASE("http: where other machines reach it, POST has to be allowed") {
  Web open({"0.0.0.0", 0});
  CHECK_FALSE(open.server.may_write());
  const std::string refused = open.ask("POST /", "", "x");
  CHECK(status(refused) == "HTTP/1.1 403 Forbidden");
  CHECK(body(refused) == "read-only, as other machines reach 0.0.0.0:" +
                             std::to_string(open.server.address().port) + "; http.write allows it\n");
  CHECK(status(open.ask("GET /")) == "HTTP/1.1 200 OK");
  CHECK(Web({"0.0.0.0", 0}, true).server.may_write());
  CHECK(Web({"localhost", 0}).server.may_write());
  CHECK(Web({"127.0.0.2", 0}).server.may_write());
  CHECK(Web({"::1", 0}).server.may_write());
}

struct Feed {
  std::string waiting;
  bool ended = false;
  bool broken = false;
  bool always = false;  ///< something new each time
  int filled = 0;
  int gone = 0;
};

class Stream final : public protocols::HttpStream {
 public:
  explicit Stream(Feed& feed) : feed_(feed) {}
  ~Stream() override { ++feed_.gone; }
  bool fill(base::Buffer& to) override {
    if (feed_.broken) throw std::runtime_error("broken");
    ++feed_.filled;
    if (feed_.always) base::append(to, "x\n");
    base::append(to, std::exchange(feed_.waiting, {}));
    return !feed_.ended;
  }
  bool has_news() const override {
    return feed_.always || !feed_.waiting.empty() || feed_.ended || feed_.broken;
  }
  std::string_view keep_alive() const override { return ":\n"; }

 private:
  Feed& feed_;
};

struct Streaming {
  Streaming() {
    web.respond = [this](const protocols::HttpRequest&) {
      return protocols::HttpResponse{200, "text/event-stream", "", std::make_unique<Stream>(feed)};
    };
    client.send("GET /events HTTP/1.1\r\nHost: " + web.host() + "\r\n\r\n");
    web.until([this] { return web.server.streams() == 1; });
  }
  void hear(const std::string& text) {
    web.until([&] { return client.heard().find(text) != std::string::npos; });
  }
  Feed feed;
  Web web;
  StreamClient client{StreamAddress{"", {"127.0.0.1", web.server.address().port}}};
};

TEST_CASE("http: a stream goes on until it ends") {
  Streaming streaming;
  streaming.feed.waiting = "first\n";
  streaming.hear("first\n");
  streaming.feed.waiting = "second\n";
  streaming.hear("second\n");
  const std::string much(100'000, 'm');
  streaming.feed.waiting = much + "end\n";
  streaming.hear("end\n");
  CHECK(std::ranges::count(streaming.client.heard(), 'm') >= 100'000);
  CHECK(streaming.feed.gone == 0);
  streaming.feed.ended = true;
  streaming.feed.waiting = "last\n";
  streaming.hear("last\n");
  streaming.web.until([&] { return streaming.feed.gone == 1; });
  CHECK(streaming.web.server.streams() == 0);
}

TEST_CASE("http: a value that changes at every moment is sent once in 20 ms") {
  Streaming streaming;
  streaming.feed.always = true;
  streaming.hear("x\n");
  const Time now = Reactor::now() + kSecond;
  const int before = streaming.feed.filled;
  for (int turn = 0; turn < 100; ++turn) {
    streaming.web.server.poll(now);
    streaming.web.reactor.poll(0);
  }
  CHECK(streaming.feed.filled == before + 1);
}

TEST_CASE("http: a stream that breaks, or whose client has gone, is over") {
  Streaming breaks;
  breaks.feed.broken = true;
  breaks.web.until([&] { return breaks.feed.gone == 1; });
  Streaming leaves;
  leaves.client.slam();
  leaves.web.until([&] {
    leaves.feed.waiting = "x";
    return leaves.feed.gone == 1;
  });
}

TEST_CASE("http: times are asked for, so that the loop may sleep") {
  Web quiet;
  quiet.turn();
  CHECK(quiet.server.next_deadline() == kNever);
  Streaming streaming;
  streaming.feed.waiting = "x";
  streaming.hear("x");
  // Without news: the keep-alive, five seconds after the last data.
  const auto due = [&] { return streaming.web.server.next_deadline(); };
  streaming.web.until([&] { return due() != kNever && due() > Reactor::now() + 2 * kSecond; });
  CHECK(due() <= Reactor::now() + 5 * kSecond);
  streaming.web.server.poll(Reactor::now() + 6 * kSecond);
  streaming.hear(":\n");
}

TEST_CASE("http: the server goes while streams are there") {
  Feed feed;
  std::optional<StreamClient> client;
  {
    Web web;
    web.respond = [&](const protocols::HttpRequest&) {
      return protocols::HttpResponse{200, "text/event-stream", "", std::make_unique<Stream>(feed)};
    };
    client.emplace(StreamAddress{"", {"127.0.0.1", web.server.address().port}});
    client->send("GET /events HTTP/1.1\r\nHost: " + web.host() + "\r\n\r\n");
    web.until([&] {
      const Time due = web.server.next_deadline();
      return web.server.streams() == 1 && due != kNever &&
             due > Reactor::now() + 2 * kSecond;  // suspended, nothing to do
    });
  }
  CHECK(feed.gone == 1);
  CHECK(client->closed());
  CHECK(client->heard().ends_with("\r\n0\r\n\r\n"));  // the end of a chunked body (RFC 9112, 7.1)
}

/// An answer whose first parts append nothing.
class Search final : public protocols::HttpStream {
 public:
  bool fill(base::Buffer& to) override {
    if (--left_ == 0) base::append(to, "found");
    return left_ != 0;
  }
  bool has_news() const override { return true; }
  bool is_answer() const override { return true; }

 private:
  int left_ = 20;
};

TEST_CASE("http: an answer goes on in each turn, also without text") {
  Web web;
  web.respond = [](const protocols::HttpRequest&) {
    return protocols::HttpResponse{200, "text/plain", "", std::make_unique<Search>()};
  };
  StreamClient client(StreamAddress{"", {"127.0.0.1", web.server.address().port}});
  client.send("GET / HTTP/1.1\r\nHost: " + web.host() + "\r\n\r\n");
  const Time now = Reactor::now();  // stands still
  web.until([&] {
    web.server.poll(now);
    web.reactor.poll(0);
    return web.server.streams() == 1;
  });
  int turns = 0;
  for (; client.heard().find("found") == std::string::npos && turns < 100; ++turns) {
    CHECK((web.server.next_deadline() == 0 || turns > 10));
    web.server.poll(now);
    web.reactor.poll(0);
  }
  CHECK(turns >= 10);
  CHECK(turns < 40);
}

TEST_CASE("http: a page's files leave no connection behind") {
  Web web;
  for (const bool closes : {true, false}) {
    web.respond = [closes](const protocols::HttpRequest&) {
      return protocols::HttpResponse{.body = "file", .closes = closes};
    };
    StreamClient client(StreamAddress{"", {"127.0.0.1", web.server.address().port}});
    client.send("GET / HTTP/1.1\r\nHost: " + web.host() + "\r\n\r\n");
    web.until([&] { return client.heard().ends_with("file"); });
    CHECK(has(client.heard(), "Connection: close") == closes);
    for (int turn = 0; turn < 10; ++turn)
      web.turn();
    CHECK(client.closed() == closes);
  }
}

/// The largest number of clients that are served at a time, each with this request.
struct Crowd {
  explicit Crowd(const std::string& request) : address{"", {"127.0.0.1", web.server.address().port}} {
    for (unsigned number = 0; number < HttpServer::kMostClients; ++number) {
      clients.push_back(std::make_unique<StreamClient>(address));
      clients.back()->send(request + " HTTP/1.1\r\nHost: " + web.host() + "\r\n\r\n");
      web.until([&] { return !clients.back()->heard().empty(); });
    }
  }
  Web web;
  StreamAddress address;
  std::vector<std::unique_ptr<StreamClient>> clients;
};

TEST_CASE("http: the client that has been idle for longest makes room for a further one") {
  Crowd crowd("GET /");
  crowd.clients[0]->send("GET / HTTP/1.1\r\nHost: " + crowd.web.host() + "\r\n\r\n");
  crowd.web.until([&] { return crowd.web.requests.size() == HttpServer::kMostClients + 1; });
  CHECK(body(crowd.web.ask("GET /")) == "hello");
  CHECK(std::ranges::count_if(crowd.clients, [](const auto& client) { return client->closed(); }) == 1);
  CHECK(crowd.clients[1]->closed());
}

TEST_CASE("http: where no client is idle a further one waits until one leaves") {
  Feed feed;
  Crowd crowd("GET /");
  crowd.web.respond = [&](const protocols::HttpRequest&) {
    return protocols::HttpResponse{200, "text/event-stream", "", std::make_unique<Stream>(feed)};
  };
  for (const auto& client : crowd.clients)
    client->send("GET / HTTP/1.1\r\nHost: " + crowd.web.host() + "\r\n\r\n");
  crowd.web.until([&] { return crowd.web.server.streams() == HttpServer::kMostClients; });
  StreamClient further(crowd.address);
  further.send("GET / HTTP/1.1\r\nHost: " + crowd.web.host() + "\r\n\r\n");
  for (int turn = 0; turn < 20; ++turn)
    crowd.web.turn();
  CHECK(further.heard().empty());
  crowd.clients[500]->slam();
  crowd.web.until([&] { return !further.heard().empty(); });
}

}  // namespace
}  // namespace cbcan::io

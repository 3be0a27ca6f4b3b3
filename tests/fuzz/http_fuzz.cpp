// SPDX-License-Identifier: MIT
// Any bytes from an HTTP client, in pieces of the length in the first byte: the server closes the connection
// or responds, JSON is valid, only commands change the plant, and the next client is served.
#include <sys/socket.h>

#include <nlohmann/json.hpp>

#include "fuzz/device_plant.hpp"
#include "fuzz/fuzz.hpp"
#include "io/http/http_server.hpp"
#include "web/api.hpp"

namespace cbcan::fuzz {

namespace {

constexpr int kMostTurns = 200;

struct Plant {
  Plant() { control.journal(); }

  std::string execute(std::string_view line) {
    ++commands;
    plant::Reply reply = control.execute(line, plant.now);
    return reply.wait ? "error: time stands still\n" : reply.text;
  }
  std::string state() {
    std::string text = control.execute("nodes", plant.now).text + control.execute("faults", plant.now).text;
    for (const std::uint16_t word : plant.network.registers())
      text.append({static_cast<char>(word), static_cast<char>(word >> 8)});
    return text;
  }

  DevicePlant plant{{}};
  plant::Control control{{&plant.network}, plant.now};
  journal::FindName find = [](std::uint8_t, std::uint8_t, std::uint16_t, std::uint8_t) { return nullptr; };
  std::size_t commands = 0;
  protocols::HttpSite::Handler api =
      web::api_of({control, find, [this](std::string_view line, const auto&) { return execute(line); }, [] {},
                   [] {
                     return web::Json{{"program", "fuzz"}};
                   },
                   "{}"});
};

/// For many inputs: a listener for each would cost more than everything else.
struct Server {
  io::Reactor reactor;
  Plant* plant = nullptr;
  io::HttpServer http{reactor,
                      {"127.0.0.1", 0},
                      false,
                      [this](const protocols::HttpRequest& request) { return plant->api(request); },
                      [](const std::string&) {}};
};

std::optional<Server> the_server;

Server& server() {
  return the_server ? *the_server : the_server.emplace();
}

struct Client {
  Client() {
    int pair[2];
    require(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) == 0,
            "there are sockets");
    socket = io::Descriptor(pair[0]);
    server().http.adopt(io::Descriptor(pair[1]));
  }

  void send(std::string_view bytes) {
    static_cast<void>(::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL));
    turn();
  }
  void turn() {
    server().http.poll(io::Reactor::now());
    server().reactor.poll(0);
    std::array<char, 65536> part;
    for (ssize_t count = 0; (count = recv(socket.get(), part.data(), part.size(), 0)) > 0;)
      heard.append(part.data(), static_cast<std::size_t>(count));
  }

  io::Descriptor socket;
  std::string heard;
};

/// The body of a chunked response (RFC 9112, 7.1); empty if it is not complete.
std::string unchunked(std::string_view rest) {
  std::string body;
  for (std::size_t end = 0; (end = rest.find("\r\n")) != rest.npos;) {
    const std::size_t size = std::strtoul(rest.data(), nullptr, 16);
    if (size == 0) return body;
    if (end + 2 + size + 2 > rest.size()) break;
    body += rest.substr(end + 2, size);
    rest.remove_prefix(end + 2 + size + 2);
  }
  return {};
}

/// Checks the JSON of the first response.
void check_json(std::string_view heard) {
  constexpr std::string_view kLength = "Content-Length: ";
  const std::size_t body = heard.find("\r\n\r\n");
  const std::string_view head = heard.substr(0, body);
  const std::size_t length = head.find(kLength);
  if (body == heard.npos || head.find("Content-Type: application/json") == head.npos) return;
  if (length == head.npos) {
    const std::string whole = unchunked(heard.substr(body + 4));
    return require(whole.empty() || nlohmann::json::accept(whole), "JSON in parts is JSON");
  }
  const std::size_t size = std::strtoul(head.data() + length + kLength.size(), nullptr, 10);
  require(nlohmann::json::accept(heard.substr(body + 4, size)), "JSON is JSON");
}

}  // namespace

void run(Input input) {
  if (input.empty()) return;
  const std::size_t piece = 1 + 16 * std::size_t{input.byte()};
  std::string_view bytes = text_of(input.rest());
  Plant plant;
  server().plant = &plant;
  const std::string before = plant.state();
  {
    Client client;
    for (; !bytes.empty(); bytes.remove_prefix(std::min(piece, bytes.size())))
      client.send(bytes.substr(0, piece));
    shutdown(client.socket.get(), SHUT_WR);
    client.turn();
    client.turn();
    require(client.heard.empty() || client.heard.starts_with("HTTP/1."), "what is said is a response");
    check_json(client.heard);
    require(plant.commands != 0 || plant.state() == before, "only commands change the plant");
  }
  Client next;
  next.send("GET /api/time HTTP/1.1\r\nHost: localhost\r\n\r\n");
  for (int turns = 0; next.heard.empty() && turns < kMostTurns; ++turns)
    next.turn();
  require(next.heard.starts_with("HTTP/1.1 200 "), "the next client is served");
  if (server().http.streams() != 0) the_server.reset();  // before the plant, whose events they read
}

}  // namespace cbcan::fuzz

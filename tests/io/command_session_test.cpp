// SPDX-License-Identifier: MIT
#include "protocols/command_session.hpp"

#include "io/sockets/stream_server.hpp"
#include "stream_client.hpp"
#include "support/catch.hpp"
#include "turns.hpp"

namespace cbcan::io {
namespace {

struct CommandServer {
  explicit CommandServer(std::string_view address = "127.0.0.1:0")
      : commands(reactor, "control", base::parse_stream_address(address),
                 protocols::command_sessions([this](std::string_view line, const auto&) {
                   executed.emplace_back(line);
                   return "did " + std::string(line) + "\n";
                 }),
                 [](const std::string&) {}) {}

  Reactor reactor;
  std::vector<std::string> executed;
  StreamServer commands;

  template <typename Done>
  void run_until(Done done) {
    test::turn_until(
        [this] {
          commands.flush();
          reactor.poll(0);
        },
        done);
  }
};

}  // namespace

TEST_CASE("Command server: each line is executed once and answered in order, in pieces of any size") {
  CommandServer server;
  StreamClient client(server.commands.address());
  for (const char c : std::string("one\r\n\ntwo\nthr")) {
    client.send(std::string(1, c));
    server.reactor.poll(0);
  }
  server.run_until([&] { return client.heard() == "did one\ndid two\n"; });
  client.send("ee\nfour\n");
  server.run_until([&] { return client.heard() == "did one\ndid two\ndid three\ndid four\n"; });
  CHECK(server.executed == std::vector<std::string>{"one", "two", "three", "four"});
}

TEST_CASE("Command server: half a line of a client that leaves is not executed; others are served") {
  CommandServer server;
  StreamClient left(server.commands.address()), stays(server.commands.address());
  left.send("half");
  left.leave();
  stays.send("whole\n");
  server.run_until([&] { return stays.heard() == "did whole\n"; });
  CHECK(server.executed == std::vector<std::string>{"whole"});
}

TEST_CASE("Command server: lines wait while their client does not read, and all are answered when it does") {
  const std::string response(100'000, 'r');
  std::size_t executed = 0;
  const auto session = protocols::command_sessions([&](std::string_view, const auto&) {
    ++executed;
    return response;
  })();
  std::string lines;
  for (int i = 0; i < 500; ++i)
    lines += "faults\n";
  session->receive(lines);
  CHECK(executed == 1);
  std::size_t heard = 0;
  while (!session->unsent().empty()) {
    CHECK(session->unsent().size() < StreamSession::kMostUnsent + response.size());
    const std::size_t part = std::min<std::size_t>(50'000, session->unsent().size());
    session->sent(part);
    heard += part;
  }
  CHECK(executed == 500);
  CHECK(heard == 500 * response.size());
}

TEST_CASE("Command server: a line that is too long is refused and nothing else is lost") {
  CommandServer server;
  StreamClient client(server.commands.address());
  client.send(std::string(protocols::kLongestCommand, 'x') + "\n");
  client.send(std::string(protocols::kLongestCommand + 1, 'y') + "\nz\n");
  server.run_until([&] { return server.executed.size() == 2; });
  CHECK(server.executed[0].size() == protocols::kLongestCommand);
  server.run_until(
      [&] { return client.heard().ends_with("error: a line of more than 1000 characters\ndid z\n"); });
}

}  // namespace cbcan::io

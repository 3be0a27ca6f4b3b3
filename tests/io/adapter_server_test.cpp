// SPDX-License-Identifier: MIT
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "io/sockets/stream_server.hpp"
#include "protocols/adapter.hpp"
#include "stream_client.hpp"
#include "support/catch.hpp"
#include "support/complaint.hpp"
#include "temporary_folder.hpp"
#include "turns.hpp"

namespace cbcan::io {
namespace {

struct SlcanServer {
  explicit SlcanServer(std::string_view address = "127.0.0.1:0")
      : slcan(
            reactor, "slcan", base::parse_stream_address(address),
            [this] {
              return protocols::slcan_adapter(
                  bus, [this] { bus.advance(0); }, protocols::Adapter::kMostUnsent, &lost);
            },
            [this](const std::string& line) { warnings.push_back(line); }) {}

  Reactor reactor;
  sim::Bus bus;
  std::vector<std::string> warnings;
  std::uint64_t lost = 0;
  StreamServer slcan;

  const StreamAddress& address() const { return slcan.address(); }
  std::size_t turn() {
    slcan.flush();
    return reactor.poll(0);
  }
  template <typename Done>
  void run_until(Done done) {
    test::turn_until([this] { turn(); }, done);
  }
};

/// The file of a socket on which no program listens.
void leave_behind(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  REQUIRE(bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
}

template <class Error>
std::string complaint(std::string_view address) {
  return cbcan::test::complaint_of<Error>(
      [&] { StreamListener("slcan", base::parse_stream_address(address)); });
}

void check_responses(SlcanServer& server, StreamClient& client, std::string_view question,
                     std::string_view response) {
  client.send(question);
  server.run_until([&] { return client.heard().size() >= response.size(); });
  CHECK(client.heard() == response);
}

TEST_CASE("addresses of streams") {
  CHECK(base::parse_stream_address("127.0.0.1:7") == StreamAddress{"", {"127.0.0.1", 7}});
  CHECK(base::parse_stream_address("[::1]") == StreamAddress{"", {"::1", 0}});
  CHECK(base::parse_stream_address("unix:a:b").path == "a:b");
  CHECK(to_string(base::parse_stream_address("unix:/run/can")) == "unix:/run/can");
  CHECK(to_string(base::parse_stream_address("[::1]:5")) == "[::1]:5");
  CHECK(complaint<UsageError>("unix:") == "address \"unix:\": the path of a socket has 1..107 characters");
  CHECK(complaint<UsageError>("unix:" + std::string(108, 'x')).ends_with("has 1..107 characters"));
}

TEST_CASE("SLCAN over a Unix socket, whose file goes with the server") {
  const test::TemporaryFolder folder;
  {
    SlcanServer server("unix:" + folder.file("s"));
    StreamClient client(server.address());
    check_responses(server, client, "V\r", "V1013\r");
  }
  CHECK(access(folder.file("s").c_str(), F_OK) != 0);
}

TEST_CASE("a Unix socket that a killed program left is replaced, one in use and a file are not") {
  const test::TemporaryFolder folder;
  const std::string address = "unix:" + folder.file("s");
  const std::string in_use =
      "slcan " + address + ": in use: another program listens there, or it is a file; write another path";
  {
    const SlcanServer server(address);
    CHECK(complaint<EnvironmentError>(address) == in_use);
  }
  leave_behind(folder.file("s"));
  CHECK(complaint<EnvironmentError>(address).empty());
  std::ofstream(folder.file("s")) << "not a socket";
  CHECK(complaint<EnvironmentError>(address) == in_use);
  CHECK(complaint<EnvironmentError>("unix:/nonexistent/s") ==
        "slcan unix:/nonexistent/s: No such file or directory; write a path in a folder that can be written");
}

TEST_CASE("a client that does not read loses frames; the others lose none") {
  SlcanServer server;
  StreamClient deaf(server.address()), sender(server.address()), reader(server.address());
  for (StreamClient* client : {&deaf, &sender, &reader})
    client->send("O\r");
  server.run_until([&] { return reader.heard() == "\r" && sender.heard() == "\r"; });
  const std::string frame = "t12381122334455667788\r";
  std::size_t sent = 0;
  while (server.lost == 0 && sent < 1'000'000) {
    sender.send(frame);
    ++sent;
    server.turn();
    reader.heard();
    sender.heard();
  }
  CHECK(server.lost > 0);
  server.run_until([&] { return sender.heard().size() == 1 + 2 * sent; });
  server.run_until([&] { return reader.heard().size() == 1 + frame.size() * sent; });
  deaf.slam();
  server.run_until([&] { return server.slcan.clients() == 2; });
}

TEST_CASE("the more clients there are, the less of each is dealt with in one turn, for all may get it") {
  SlcanServer server;
  std::vector<std::unique_ptr<StreamClient>> clients;
  for (int i = 0; i < 64; ++i) {
    clients.push_back(std::make_unique<StreamClient>(server.address()));
    check_responses(server, *clients.back(), "O\r", "\r");
  }
  std::string frames;
  for (int i = 0; i < 100; ++i)
    frames += "t12381122334455667788\r";
  for (const auto& client : clients)
    client->send(frames);
  struct Counter final : sim::Receiver {
    void on_frame(const Frame& /*frame*/, Time /*now*/) override { ++frames; }
    std::size_t frames = 0;
  } all;
  server.bus.attach(all).accept_all();
  server.turn();
  CHECK(all.frames <= 64 * 6);
  server.run_until([&] { return all.frames == 64 * 100; });
}

TEST_CASE("a client that asks and does not read the responses is not read from either, and can go on later") {
  SlcanServer server;
  StreamClient client(server.address());
  const std::string questions(4096, '\r');
  constexpr std::size_t kFarMore = 100'000'000;
  std::size_t sent = 0;
  for (int vain = 0; vain < 100 && sent < kFarMore; ++vain) {
    const std::size_t taken = client.send_some(questions);
    if (taken > 0) vain = 0;
    sent += taken;
    server.turn();
  }
  CHECK(sent < kFarMore);
  server.run_until([&] { return client.heard().size() == sent; });
}

}  // namespace
}  // namespace cbcan::io

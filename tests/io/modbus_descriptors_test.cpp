// SPDX-License-Identifier: MIT
// As many clients as descriptors, and one more.
#include <fcntl.h>
#include <sys/resource.h>

#include "modbus_fixture.hpp"

namespace cbcan::io::test {
namespace {

// libmodbus: the process aborts at the first descriptor above 1023.
TEST_CASE("clients beyond descriptor 1023 are served") {
  Server server;
  std::deque<Client> clients;
  for (int i = 0; i < 1100; ++i) {
    clients.emplace_back(server);
    server.run_until_quiet();
  }
  REQUIRE(server.modbus.clients() == 1100);
  check_served_at_once(server, clients.front());
  check_served_at_once(server, clients.back());
  clients.back().send("00 01 00 00 00 06 01 63 00 00 00 01");  // where libmodbus would select()
  server.run_until([&] { return clients.back().has(9); });
  CHECK(clients.back().take() == hex("00 01 00 00 00 03 01 E3 01"));
}

/// Uses up this process's descriptors for its lifetime.
struct NoDescriptors {
  NoDescriptors() {
    REQUIRE(getrlimit(RLIMIT_NOFILE, &before_) == 0);
    const rlimit low{kLimit, before_.rlim_max};
    REQUIRE(setrlimit(RLIMIT_NOFILE, &low) == 0);
    while (const Descriptor& filler = fillers_.emplace_back(open("/dev/null", O_RDONLY | O_CLOEXEC)))
      static_cast<void>(filler);
    fillers_.pop_back();
  }
  ~NoDescriptors() { setrlimit(RLIMIT_NOFILE, &before_); }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;

  void free_one() { fillers_.pop_back(); }

 private:
  static constexpr rlim_t kLimit = 200;
  rlimit before_{};
  std::vector<Descriptor> fillers_;
};

TEST_CASE("where no client is idle a new one is turned away at once, one line says so, and nothing spins") {
  Server server;
  Client healthy(server);
  Client first(Client::kSystemBuffer);
  Client second(Client::kSystemBuffer);
  Client third(Client::kSystemBuffer);
  server.run_until([&] { return server.modbus.clients() == 1; });
  healthy.send("BE EF 00 00 00 06");
  server.run_until_quiet();
  NoDescriptors none;
  first.connect_to(server);
  second.connect_to(server);
  server.run_until([&] { return first.closed() && second.closed(); });
  CHECK(server.turn() == 0);
  REQUIRE(server.warnings.size() == 1);
  CHECK(server.warnings[0] ==
        "modbus " + to_string(server.modbus.address()) +
            ": no descriptor left for a further client (1 are connected); raise the limit with "
            "`ulimit -n`");
  CHECK(ask(server, healthy, "01 03 00 00 00 01", 11) == hex("BE EF 00 00 00 05 01 03 02 00 00"));
  none.free_one();
  third.connect_to(server);
  check_served_at_once(server, third);
}

TEST_CASE(
    "without a descriptor the connection that has been idle for longest makes room, and none that has a "
    "request") {
  constexpr auto kRequest = "00 01 00 00 00 06 01 03 00 00 00 01";
  Server server;
  Client slow(server, 2048);
  slow.set(SOL_SOCKET, SO_SNDBUF, 1 << 20);
  for (std::uint64_t sent = 0; server.counters.requests == sent; ++sent) {  // until it is not read from
    slow.send("00 01 00 00 00 06 01 03 00 00 00 7D");
    server.run_until_quiet();
  }
  std::deque<Client> clients;
  for (int i = 0; i < 16; ++i)
    check_served_at_once(server, clients.emplace_back(server));
  check_served_at_once(server, clients[0]);
  clients[1].send("00 01 00 00 00 06 01");
  server.run_until_quiet();
  Client further(Client::kSystemBuffer);
  const NoDescriptors none;
  further.connect_to(server);
  clients[2].send(kRequest);  // is still unread when the further one is accepted
  server.run_until([&] { return clients[2].has(11) && clients[3].closed(); });
  check_served_at_once(server, further);
  CHECK(server.modbus.clients() == 17);
  CHECK(std::ranges::count_if(clients, [](Client& client) { return client.closed(); }) == 1);
  CHECK(server.warnings.empty());
  CHECK_FALSE(slow.closed());
}

/// TCP_USER_TIMEOUT is about bytes without acknowledgement, keep-alive about silence: Linux, tcp(7).
TEST_CASE("a response that is not acknowledged for two minutes ends the connection") {
  Server server;
  const StreamListener listener("x", {"", {"127.0.0.1", 0}});
  StreamClient client(listener.address());
  Descriptor accepted(accept4(listener.socket(), nullptr, nullptr, SOCK_NONBLOCK));
  const Descriptor same(dup(accepted.get()));
  server.modbus.adopt(std::move(accepted));
  int milliseconds = 0;
  socklen_t size = sizeof milliseconds;
  REQUIRE(getsockopt(same.get(), IPPROTO_TCP, TCP_USER_TIMEOUT, &milliseconds, &size) == 0);
  CHECK(milliseconds == 120'000);
}

}  // namespace
}  // namespace cbcan::io::test

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

TEST_CASE("without a descriptor a new client is turned away at once, one line says so, and nothing spins") {
  Server server;
  Client healthy(server);
  Client first(Client::kSystemBuffer);
  Client second(Client::kSystemBuffer);
  Client third(Client::kSystemBuffer);
  server.run_until([&] { return server.modbus.clients() == 1; });
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
  check_served_at_once(server, healthy);
  none.free_one();
  third.connect_to(server);
  check_served_at_once(server, third);
}

}  // namespace
}  // namespace cbcan::io::test

// SPDX-License-Identifier: MIT
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "io/loop/system.hpp"
#include "io/sockets/listener.hpp"
#include "stream_client.hpp"
#include "support/catch.hpp"
#include "support/complaint.hpp"

namespace cbcan::io {
namespace {

StreamListener listening(const ListenAddress& address) {
  return {"modbus", {"", address}};
}

std::string complaint(const ListenAddress& address) {
  return cbcan::test::complaint_of<EnvironmentError>([&] { listening(address); });
}

/// Drops root's rights for its lifetime.
struct Unprivileged {
  Unprivileged() { REQUIRE(seteuid(geteuid() == 0 ? kNobody : geteuid()) == 0); }
  ~Unprivileged() {
    if (seteuid(getuid()) != 0) std::abort();
  }
  Unprivileged(const Unprivileged&) = delete;
  Unprivileged& operator=(const Unprivileged&) = delete;

 private:
  static constexpr uid_t kNobody = 65534;
};

TEST_CASE("a name is looked up, IPv4 first; an IPv6 address works too") {
  CHECK(listening({"localhost", 0}).address().tcp.host == "127.0.0.1");
  CHECK(listening({"::1", 0}).address().tcp.host == "::1");
}

TEST_CASE("a privileged port is reported with the same port a thousand higher") {
  const Unprivileged nobody;
  CHECK(complaint({"127.0.0.1", 502}) ==
        "modbus 127.0.0.1:502: permission denied: ports below 1024 need root; use 127.0.0.1:1502");
}

TEST_CASE("another machine's address and an impossible name are reported") {
  CHECK(complaint({"203.0.113.1", 1502}) ==
        "modbus 203.0.113.1:1502: not an address of this machine; `ip address` lists them, 0.0.0.0 is all of "
        "them");
  CHECK(complaint({"no such host", 1502}) ==
        "modbus no such host:1502: Name or service not known: write an address of this machine, such as "
        "127.0.0.1");
}

/// Linux, tcp(7): in seconds, and a number of probes.
TEST_CASE("a client that has vanished is noticed two minutes after its last byte") {
  struct Taker final : AcceptsClients {
    void adopt(Descriptor socket) override { client = std::move(socket); }
    std::size_t clients() const override { return client ? 1 : 0; }
    Descriptor client;
  } server;
  Reactor reactor;
  const Acceptor acceptor(reactor, "x", {"", {"127.0.0.1", 0}}, server, [](const std::string&) {});
  const StreamClient client(acceptor.listener().address());
  while (!server.client)
    reactor.poll(0);
  const auto option = [&](int level, int name) {
    int value = -1;
    socklen_t size = sizeof value;
    REQUIRE(getsockopt(server.client.get(), level, name, &value, &size) == 0);
    return value;
  };
  CHECK(option(SOL_SOCKET, SO_KEEPALIVE) == 1);
  CHECK(option(IPPROTO_TCP, TCP_KEEPIDLE) == 60);
  CHECK(option(IPPROTO_TCP, TCP_KEEPINTVL) == 10);
  CHECK(option(IPPROTO_TCP, TCP_KEEPCNT) == 6);
}

}  // namespace
}  // namespace cbcan::io

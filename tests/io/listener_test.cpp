// SPDX-License-Identifier: MIT
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "io/errors.hpp"
#include "io/sockets/listener.hpp"
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

}  // namespace
}  // namespace cbcan::io

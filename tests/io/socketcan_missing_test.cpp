// SPDX-License-Identifier: MIT
#include <sys/socket.h>

#include <cerrno>

#include "io/can/socketcan.hpp"
#include "support/catch.hpp"

namespace cbcan::io {
namespace {

bool kernel_has_can() {
  return static_cast<bool>(Descriptor(socket(PF_CAN, SOCK_RAW, 1)));
}

TEST_CASE("an interface that cannot be had is an error that says what to do") {
  Reactor reactor;
  sim::Bus bus;
  const std::string expected =
      kernel_has_can()
          ? "can socketcan:nocan9: no such interface; `ip link` lists them; for a virtual one: "
            "ip link add dev nocan9 type vcan && ip link set nocan9 up"
          : "can socketcan:nocan9: this kernel has no CAN (Address family not supported by protocol); "
            "`tools/dev/in-vcan-vm COMMAND` runs a command where there is vcan0, and the virtual bus needs "
            "no kernel";
  try {
    const SocketCan can(reactor, bus, "nocan9", nullptr);
    FAIL("no exception");
  } catch (const EnvironmentError& error) {
    CHECK(error.what() == expected);
  }
}

}  // namespace
}  // namespace cbcan::io

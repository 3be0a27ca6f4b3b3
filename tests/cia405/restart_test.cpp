// SPDX-License-Identifier: MIT
// A server or a program is killed during a transaction.

#include "cia405/fake_server.hpp"
#include "support/catch.hpp"

namespace cbcan::cia405::test {

TEST_CASE("a server that is killed and restarted: 21h, then everything works, settings are written again") {
  auto plant = std::make_unique<Plant>();
  const int port = plant->port();
  Program program(port);
  SdoRead4 read(program.link);
  read.timeout = 300;
  program.blocks = {&read};
  Time now = 0;
  const auto begin = [&](std::uint8_t device, std::uint16_t index) {
    read.enable = false;
    program.cycle(now);
    read.device = device;
    read.index = index;
    read.enable = true;
    program.cycle(now);
  };
  const auto end = [&] {
    while (!read.confirm && read.error == KernelError::kNone)
      program.cycle(now += kMs);
    return read.error;
  };
  begin(5, 0x2004);
  REQUIRE(end() == KernelError::kNone);
  begin(5, 0x2004);
  plant.reset();
  CHECK(end() == KernelError::kInternal);

  plant = std::make_unique<Plant>(port);
  now += kSecond;
  begin(5, 0x2004);
  CHECK(end() == KernelError::kNone);
  begin(0, 0x3003);
  CHECK(end() == KernelError::kNone);
  CHECK(read.data == std::array<std::uint8_t, 4>{0xB5, 0x01, 0, 0});
}

TEST_CASE("result 5 on a channel: 3003h and 3004h are written again") {
  FakeServer server;
  Program program(server.port());
  SdoRead4 read(program.link);
  program.blocks = {&read};
  read.channel = 2;
  read.device = 5;
  read.timeout = 300;
  read.enable = true;
  Time now = 0;
  while (program.link.events() != POLLIN)
    program.cycle(now);
  server.accept();
  std::string number = "0000";
  std::vector<std::string> objects;
  const auto serve = [&](const std::string& restarted_at) {
    for (std::string result = "0000"; !read.confirm; program.cycle(now += kMs)) {
      const std::string request = server.request();
      if (request.substr(2, 2) == "17") {
        server.respond("011706000000050000");
      } else if (request.substr(2, 2) == "10") {
        number = request.substr(14, 4);
        objects.push_back(request.substr(26, 4));
        result = number == restarted_at ? "0005" : "0000";
        server.respond("011002BC" + request.substr(8, 4));
      } else {
        server.respond("01030C" + number + result + number + "0001" + "00000000");
      }
    }
  };
  serve("");
  read.enable = false;
  program.cycle(now);
  read.enable = true;
  while (program.link.events() != POLLIN)
    program.cycle(now);
  serve("0004");
  CHECK(objects == std::vector<std::string>{"3003", "3004", "0000", "0000", "3003", "3004", "0000"});
}

}  // namespace cbcan::cia405::test

// SPDX-License-Identifier: MIT
// A server, or a program, that is killed in the middle.

#include "cia405/fake_server.hpp"
#include "support/catch.hpp"

namespace cbcan::cia405::test {

TEST_CASE("a server that is killed and comes back: 21h, then everything works, settings written anew") {
  auto plant = std::make_unique<Plant>();
  Program program(plant->port());
  SdoRead4 read(program.link);
  read.device = 5;
  read.index = 0x2004;
  read.timeout = 300;
  program.blocks = {&read};
  Time now = 0;
  const auto until_ended = [&] {
    while (!read.confirm && read.error == KernelError::kNone)
      program.cycle(now += kMs);
  };
  read.enable = true;
  until_ended();
  REQUIRE(read.confirm);
  read.enable = false;
  program.cycle(now);
  read.enable = true;
  program.cycle(now);
  const int port = plant->port();
  plant.reset();
  until_ended();
  CHECK(read.error == KernelError::kInternal);
  read.enable = false;
  program.cycle(now);

  plant = std::make_unique<Plant>(std::vector<std::string>{}, port);
  now += kSecond;
  read.enable = true;
  until_ended();
  CHECK(read.confirm);
  SdoRead4 timeout(program.link);
  timeout.index = 0x3003;
  timeout.enable = true;
  program.blocks = {&timeout};
  while (!timeout.confirm)
    program.cycle(now += kMs);
  CHECK(timeout.data == std::array<std::uint8_t, 4>{0xB5, 0x01, 0, 0});
}

TEST_CASE("a module behind a gateway restarts, and the connection stays: 21h, settings written anew") {
  Plant plant;
  Program program(plant.port());
  SdoRead4 read(program.link);
  program.blocks = {&read};
  read.channel = 2;  // scenarios.txt has channel 1
  read.timeout = 300;
  Time now = 0;
  const auto execute = [&](std::uint8_t device, std::uint16_t index) {
    read.enable = false;
    program.cycle(now);
    read.device = device;
    read.index = index;
    read.enable = true;
    while (device == 9 ? plant.frames("609#").empty() : !read.confirm && read.error == KernelError::kNone)
      program.cycle(now += kMs);
  };
  execute(5, 0x2004);
  REQUIRE(read.confirm);
  execute(9, 0x2004);  // no such node
  CHECK(plant.command("write 700 99 5066 0 0x3003 0 2 1000") == "ok");
  CHECK(plant.command("write 800 0 5 0") == "ok");
  for (int i = 0; i < 5; ++i)
    program.cycle(now += kMs);
  CHECK(read.error == KernelError::kInternal);
  execute(5, 0x2004);
  CHECK(read.confirm);
  execute(0, 0x3003);
  CHECK(read.data == std::array<std::uint8_t, 4>{0xB5, 0x01, 0, 0});
}

TEST_CASE("result 5 on a channel: 3003h and 3004h are written anew") {
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
        server.respond(
            "011706"
            "0000"
            "0005"
            "0000");
      } else if (request.substr(2, 2) == "10") {
        number = request.substr(14, 4);
        objects.push_back(request.substr(26, 4));
        result = number == restarted_at ? "0005" : "0000";
        server.respond(
            "0110"
            "02BC" +
            request.substr(8, 4));
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

TEST_CASE("a transaction that a program has left behind is cancelled, and its result is nobody's") {
  Plant plant;
  {
    Program gone(plant.port());
    SdoRead4 read(gone.link);
    read.device = 9;
    read.enable = true;
    gone.blocks = {&read};
    while (plant.frames("609#").empty())
      gone.cycle(0);
  }  // its connection is closed, and nothing is said
  Program program(plant.port());
  GetLocalNodeId id(program.link);
  id.enable = true;
  program.blocks = {&id};
  while (!id.confirm && id.error == KernelError::kNone)
    program.cycle(0);
  CHECK(id.device == 127);
  CHECK(plant.frames("609#").size() == 2);
  CHECK(plant.frames("609#").back() == "609#8000000000000008");
}

}  // namespace cbcan::cia405::test

// SPDX-License-Identifier: MIT
// A server, or a program, that is killed in the middle.

#include "cia405/plant.hpp"
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

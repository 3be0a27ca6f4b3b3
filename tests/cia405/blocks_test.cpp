// SPDX-License-Identifier: MIT
// Specific to the blocks in C++: their lifetime and members, and run(). The rest is in scenarios.txt.

#include "cia405/plant.hpp"
#include "support/catch.hpp"

namespace cbcan::cia405::test {

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A plant with one program, whose cycle takes a millisecond.
struct Rig {
  void cycles(int count) {
    for (int i = 0; i < count; ++i) {
      program.cycle(plant.now());
      plant.pass(kMs);
    }
  }

  Plant plant;
  Program program{plant.port()};
};

/// Node 5's 2004h, four bytes.
void four_bytes(SdoAccess& block) {
  block.device = 5;
  block.index = 0x2004;
  block.enable = true;
}

}  // namespace

TEST_CASE("inputs are taken at the rising edge, and outputs change in call() alone") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  four_bytes(read);
  read.call(rig.plant.now());
  read.index = 0x2FFF;
  read.device = 200;
  rig.program.blocks = {&read};
  rig.cycles(20);
  CHECK(read.confirm);
  CHECK(rig.plant.frames("605#") == std::vector<std::string>{"605#4004200000000000"});
  read.enable = false;
  CHECK(read.confirm);
}

TEST_CASE("a block that goes away while it is enabled is cancelled") {
  Rig rig;
  auto read = std::make_unique<SdoRead4>(rig.program.link);
  four_bytes(*read);
  read->device = 9;
  rig.program.blocks = {read.get()};
  rig.cycles(20);
  rig.program.blocks.clear();
  read.reset();
  rig.cycles(5);
  CHECK(rig.plant.frames("609#") == std::vector<std::string>{"609#4004200000000000", "609#8004200000000008"});
}

TEST_CASE("SdoRead into a buffer that has become smaller is ERROR 21h, and writes nothing") {
  Rig rig;
  Bytes buffer(4, 0xEE);
  SdoRead read(rig.program.link);
  four_bytes(read);
  read.data = buffer;
  read.call(0);
  read.data = std::span(buffer).first(3);
  rig.program.blocks = {&read};
  rig.cycles(20);
  CHECK(read.error == KernelError::kInternal);
  CHECK(buffer == Bytes(4, 0xEE));
}

TEST_CASE("run() blocks until the end, or the deadline: then the execution is cancelled") {
  using std::chrono::steady_clock;
  Plant plant;
  Link link({.port = plant.port()});
  GetLocalNodeId id(link);
  SdoRead4 slow(link);
  slow.device = 99;  // does not exist, and time stops in this plant
  slow.index = 0x2004;
  const auto soon = [] { return steady_clock::now() + std::chrono::milliseconds(50); };
  for (int i = 0; i < 2; ++i) {
    CHECK(run(id, steady_clock::time_point::max()));
    CHECK(id.device == 127);
    CHECK_FALSE(run(slow, soon()));
    CHECK(slow.error == KernelError::kTimeout);
  }
  // The second one was delayed: the first one's response might still come.
  CHECK(plant.frames("663#") == std::vector<std::string>{"663#4004200000000000", "663#8004200000000008"});
  id.network = 9;
  CHECK_FALSE(run(id, steady_clock::time_point::max()));
  CHECK(id.error == KernelError::kInternal);
}

}  // namespace cbcan::cia405::test

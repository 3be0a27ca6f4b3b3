// SPDX-License-Identifier: MIT
// Many blocks of one program: the queue of each network, and networks taking turns.

#include <algorithm>

#include "cia405/fake_server.hpp"
#include "support/catch.hpp"

namespace cbcan::cia405::test {

namespace {

/// Reads of node 5's 1018h, each of a sub-index of its own, that begin again as soon as they have ended.
struct Reader {
  explicit Reader(Link& link) : read(link) {
    read.device = 5;
    read.index = 0x1018;
  }
  /// Once per cycle.
  void turn() {
    const bool ended = read.confirm || read.error != KernelError::kNone;
    if (ended) ++executions;
    read.enable = !ended;
  }

  SdoRead4 read;
  int executions = 0;
};

}  // namespace

TEST_CASE("executions are served in the order of their rising edges") {
  Rig rig;
  std::vector<std::unique_ptr<SdoRead4>> blocks;
  for (int i = 0; i < 5; ++i) {
    blocks.push_back(std::make_unique<SdoRead4>(rig.program.link));
    blocks.back()->device = 5;
    blocks.back()->index = static_cast<std::uint16_t>(0x2F00 + i);
    rig.program.blocks.push_back(blocks.back().get());
  }
  for (const std::size_t i : {3u, 0u, 4u, 2u, 1u}) {
    blocks[i]->enable = true;
    blocks[i]->call(rig.plant.now());
  }
  blocks[4]->enable = false;  // cancelled and enabled again: it goes to the end
  blocks[4]->call(rig.plant.now());
  blocks[4]->enable = true;
  blocks[4]->call(rig.plant.now());
  rig.until([&] { return blocks[4]->error != KernelError::kNone; });
  CHECK(rig.plant.frames("605#") == std::vector<std::string>{"605#40032F0000000000", "605#40002F0000000000",
                                                             "605#40022F0000000000", "605#40012F0000000000",
                                                             "605#40042F0000000000"});
}

TEST_CASE("blocks that never rest get the same number of executions") {
  Rig rig;
  std::vector<std::unique_ptr<Reader>> readers;
  for (int i = 0; i < 7; ++i) {
    readers.push_back(std::make_unique<Reader>(rig.program.link));
    readers.back()->read.subindex = static_cast<std::uint8_t>(i % 5);
    rig.program.blocks.push_back(&readers.back()->read);
  }
  for (int cycle = 0; cycle < 1000; ++cycle) {
    for (const auto& reader : readers)
      reader->turn();
    rig.cycle();
  }
  const auto [least, most] =
      std::ranges::minmax_element(readers, {}, [](const auto& reader) { return reader->executions; });
  CHECK((*least)->executions > 50);
  CHECK((*most)->executions - (*least)->executions <= 1);
}

TEST_CASE("a block whose device is silent holds up the others for its TIMEOUT, and no longer") {
  Rig rig;
  SdoRead4 silent(rig.program.link), other(rig.program.link);
  silent.device = 9;
  silent.timeout = 100;
  other.device = 5;
  other.index = 0x2004;
  silent.enable = other.enable = true;
  rig.program.blocks = {&silent, &other};
  rig.until([&] { return other.confirm; });
  CHECK(silent.error == KernelError::kTimeout);
  CHECK(rig.plant.now() >= 100 * kMs);
  CHECK(rig.plant.now() <= 130 * kMs);
}

TEST_CASE("NETWORK is the Modbus unit ID, and networks take turns") {
  FakeServer server;
  Program program(server.port());
  GetLocalNodeId first(program.link), second(program.link);
  second.network = 2;
  first.enable = second.enable = true;
  program.blocks = {&first, &second};
  Time now = 0;
  while (program.link.events() != POLLIN)
    program.cycle(now);
  server.accept();
  std::string units;
  for (int i = 0; i < 8; ++i) {
    const std::string request = server.request();
    const std::string unit = request.substr(0, 2);
    units += unit + " ";
    const std::string result = unit +
                               "038C"
                               "000013BF0000300100000001"
                               "0007";
    server.answer(request.substr(2, 2) == "03" ? result + std::string(4 * 63, '0') : request.substr(0, 12));
    program.cycle(now);
    if (first.confirm && second.confirm) break;
  }
  CHECK(units == "01 02 01 02 01 02 ");
  CHECK(first.confirm);
  CHECK(second.confirm);
}

TEST_CASE(
    "each network has its own module and queue; one that there is not is ERROR 21h and disturbs nobody") {
  Rig rig({"--network", "2", "--node-id", "42", "--node", "5=" CBCAN_PLANTS "/demo/generic.eds"});
  SdoRead4 hangs(rig.program.link);
  hangs.device = 9;
  GetLocalNodeId id(rig.program.link), waits(rig.program.link), none(rig.program.link);
  id.network = 2;
  none.network = 3;
  SdoRead4 read(rig.program.link);
  read.network = 2;
  read.device = 5;
  read.index = 0x2004;
  rig.program.blocks = {&hangs, &id, &waits, &none, &read};
  for (FunctionBlock* block : rig.program.blocks)
    block->enable = true;
  rig.cycles(50);
  CHECK(id.device == 42);
  CHECK(read.confirm);
  CHECK(none.error == KernelError::kInternal);
  CHECK(none.device == 0);
  CHECK(hangs.error == KernelError::kNone);
  CHECK_FALSE(waits.confirm);  // behind the one that hangs
  hangs.enable = false;
  rig.cycles(5);
  CHECK(waits.device == 127);
}

}  // namespace cbcan::cia405::test

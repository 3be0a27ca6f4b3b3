// SPDX-License-Identifier: MIT
// What only the blocks in C++ have: their lifetime and members, and networks. The rest is in scenarios.txt.

#include "cia405/fake_server.hpp"
#include "support/catch.hpp"

#include <algorithm>
#include <memory>

namespace cbcan::cia405::test {

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A plant with one program, whose cycle takes a millisecond.
struct Rig {
  explicit Rig(const std::vector<std::string>& options = {}) : plant(options), program(plant.port()) {}

  void cycles(int count) {
    for (int i = 0; i < count; ++i) {
      program.cycle(plant.now());
      plant.pass(kMs);
    }
  }

  Plant plant;
  Program program;
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

TEST_CASE("a mode that there is not is ERROR 21h") {
  Rig rig;
  SdoWrite write(rig.program.link);
  four_bytes(write);
  const Bytes byte(1);
  write.data = byte;
  write.mode = SdoMode{4};
  write.call(0);
  CHECK(write.error == KernelError::kInternal);
}

TEST_CASE("ten blocks, ten devices of 50 ms: CHANNEL makes the difference") {
  std::vector<std::string> options;
  for (int device = 11; device <= 20; ++device)
    options.insert(options.end(), {"--node", std::to_string(device) + "=" CBCAN_PLANTS "/demo/generic.eds"});
  const auto cycles_of = [&](std::uint8_t channel) {
    Rig rig(options);
    std::vector<std::unique_ptr<SdoRead4>> blocks;
    for (std::uint8_t device = 11; device <= 20; ++device) {
      rig.plant.command("fault " + std::to_string(device) + " response-late delay_ms=50");
      SdoRead4& block = *blocks.emplace_back(std::make_unique<SdoRead4>(rig.program.link));
      rig.program.blocks.push_back(&block);
      four_bytes(block);
      block.device = device;
      block.channel = channel;
    }
    const auto done = [](const auto& block) { return block->confirm; };
    for (int cycles = 0; cycles < 2000; ++cycles) {
      if (std::all_of(blocks.begin(), blocks.end(), done)) return cycles;
      rig.cycles(1);
    }
    return 0;
  };
  CHECK(cycles_of(1) >= 500);
  const int any = cycles_of(0);
  CHECK(any > 50);
  CHECK(any < 250);
}

TEST_CASE("a module with one channel: CHANNEL 0 is that one, others are ERROR 21h") {
  Rig rig({"--set", "module.channels=1"});
  SdoRead4 first(rig.program.link), any(rig.program.link), second(rig.program.link);
  rig.program.blocks = {&first, &any, &second};
  for (SdoRead4* block : {&first, &any, &second})
    four_bytes(*block);
  any.channel = 0;
  second.channel = 2;
  rig.cycles(40);
  CHECK(first.confirm);
  CHECK(any.confirm);
  CHECK(second.error == KernelError::kInternal);
}

TEST_CASE("a reset of the module's node is known on all channels") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  Nmt reset(rig.program.link);
  rig.program.blocks = {&read, &reset};
  read.channel = 2;
  read.timeout = 200;
  reset.device = 127;
  reset.state = TransitionState::kResetNode;
  rig.plant.command("fault 5 response-never after=1");
  four_bytes(read);
  rig.cycles(20);
  CHECK(read.confirm);
  read.enable = false;
  reset.enable = true;
  rig.cycles(10);
  CHECK(reset.confirm);
  four_bytes(read);
  rig.cycles(250);
  CHECK(read.error == KernelError::kTimeout);
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
                               "0310"
                               "000013BF0000300100000001"
                               "0007";
    server.respond(request.substr(2, 2) == "03" ? result + "0000" : request.substr(0, 12));
    program.cycle(now);
    if (first.confirm && second.confirm) break;
  }
  CHECK(units == "01 02 01 02 01 02 ");
  CHECK(first.confirm);
  CHECK(second.confirm);
}

TEST_CASE("each network has its own module and queue; one that there is not is ERROR 21h") {
  Rig rig({"--network", "2", "--set", "module.node_id=42", "--node", "5=" CBCAN_PLANTS "/demo/generic.eds"});
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

TEST_CASE("run() blocks until the end, or the deadline: then the execution is cancelled") {
  using std::chrono::steady_clock;
  Plant plant;
  Link link({.port = plant.port()});
  GetLocalNodeId id(link);
  SdoRead4 slow(link);
  slow.device = 99;  // there is none, and time stands still in this plant
  slow.index = 0x2004;
  const auto soon = [] { return steady_clock::now() + std::chrono::milliseconds(50); };
  for (int i = 0; i < 2; ++i) {
    CHECK(run(id, steady_clock::time_point::max()));
    CHECK(id.device == 127);
    CHECK_FALSE(run(slow, soon()));
    CHECK(slow.error == KernelError::kTimeout);
  }
  // The second one has been held back: the first one's response might still come.
  CHECK(plant.frames("663#") == std::vector<std::string>{"663#4004200000000000", "663#8004200000000008"});
  id.network = 9;
  CHECK_FALSE(run(id, steady_clock::time_point::max()));
  CHECK(id.error == KernelError::kInternal);
}

}  // namespace cbcan::cia405::test

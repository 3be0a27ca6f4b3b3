// SPDX-License-Identifier: MIT
// How an execution begins and ends: the three diagrams, TIMEOUT, and transfers that are cancelled in the
// middle.

#include "cia405/plant.hpp"
#include "support/catch.hpp"

namespace cbcan::cia405::test {

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A read of node `device`'s 2004h; node 9 does not exist.
void aim(SdoRead4& block, std::uint8_t device, std::uint32_t timeout = 0) {
  block.device = device;
  block.index = 0x2004;
  block.timeout = timeout;
}

/// A block that is called in each cycle of the rig.
void begin(Rig& rig, FunctionBlock& block) {
  block.enable = true;
  rig.program.blocks = {&block};
}

bool ended(const FunctionBlock& block) {
  return block.confirm || block.error != KernelError::kNone;
}

}  // namespace

TEST_CASE("done: CONFIRM stays while ENABLE is true, all outputs are 0 after it, and it can begin again") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  aim(read, 5);
  read.index = 0x1018;
  read.subindex = 0;  // 4, in one byte
  begin(rig, read);
  REQUIRE(rig.until([&] { return read.confirm; }));
  rig.cycles(10);
  CHECK(read.confirm);
  CHECK(read.data[0] == 4);
  CHECK(rig.plant.frames("605#").size() == 1);

  read.enable = false;
  CHECK(read.confirm);  // until it is called
  rig.cycle();
  CHECK_FALSE(read.confirm);
  CHECK(read.error == KernelError::kNone);
  CHECK(read.data == std::array<std::uint8_t, 4>{});
  CHECK(read.datalength == 0);
  rig.cycles(10);
  CHECK(rig.plant.frames("605#").size() == 1);

  read.enable = true;
  REQUIRE(rig.until([&] { return read.confirm; }));
  CHECK(rig.plant.frames("605#").size() == 2);
}

TEST_CASE("done: the next execution begins without a cycle of rest when ENABLE was false for one call") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  aim(read, 5);
  rig.program.blocks = {&read};
  int confirmed = 0;
  for (int i = 0; i < 100; ++i) {
    read.enable = !ended(read);  // as PLC programs do it
    rig.cycle();
    if (read.confirm) ++confirmed;
  }
  CHECK(confirmed > 15);
  CHECK(static_cast<int>(rig.plant.frames("605#").size()) >= confirmed);
}

TEST_CASE("cancelled: outputs stay 0, a late answer is not seen, and the device is sent one abort") {
  Rig rig;
  rig.plant.command("fault 5 answer-late delay_ms=50 count=1");
  SdoRead4 read(rig.program.link);
  aim(read, 5);
  begin(rig, read);
  rig.until([&] { return !rig.plant.frames("605#").empty(); });
  read.enable = false;
  rig.cycles(100);
  CHECK_FALSE(read.confirm);
  CHECK(read.error == KernelError::kNone);
  CHECK(read.errorinfo == 0);
  CHECK(rig.plant.frames("605#") == std::vector<std::string>{"605#4004200000000000", "605#8004200000000008"});
}

TEST_CASE("cancelled while it waits in the queue: nothing is sent for it") {
  Rig rig;
  SdoRead4 first(rig.program.link), second(rig.program.link);
  aim(first, 9);
  aim(second, 5);
  first.enable = second.enable = true;
  rig.program.blocks = {&first, &second};
  rig.cycles(20);
  second.enable = false;
  rig.cycles(20);
  first.enable = false;
  rig.cycles(2000);
  CHECK(rig.plant.frames("605#").empty());
  CHECK(rig.plant.frames("609#").size() == 2);
}

TEST_CASE("a block that goes away while it is enabled is cancelled") {
  Rig rig;
  auto read = std::make_unique<SdoRead4>(rig.program.link);
  aim(*read, 9);
  begin(rig, *read);
  rig.until([&] { return !rig.plant.frames("609#").empty(); });
  rig.program.blocks.clear();
  read.reset();
  rig.cycles(5);
  CHECK(rig.plant.frames("609#").back() == "609#8004200000000008");
}

TEST_CASE("error: ERROR stays while ENABLE is true, is 0 after it, and it can begin again") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  aim(read, 5);
  read.index = 0x2FFF;
  begin(rig, read);
  REQUIRE(rig.until([&] { return ended(read); }));
  rig.cycles(10);
  CHECK(read.error == KernelError::kOther);
  CHECK(read.errorinfo == 0x06020000);
  CHECK(rig.plant.frames("605#").size() == 1);
  read.enable = false;
  rig.cycle();
  CHECK(read.error == KernelError::kNone);
  CHECK(read.errorinfo == 0);
  read.index = 0x2004;
  read.enable = true;
  REQUIRE(rig.until([&] { return ended(read); }));
  CHECK(read.confirm);
}

TEST_CASE("inputs are taken at the rising edge") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  aim(read, 5);
  begin(rig, read);
  read.call(rig.plant.now());
  read.index = 0x2FFF;
  read.device = 200;
  REQUIRE(rig.until([&] { return ended(read); }));
  CHECK(read.confirm);
  CHECK(rig.plant.frames("605#").front() == "605#4004200000000000");
}

TEST_CASE("TIMEOUT: 03h at its time, and the transaction is cancelled") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  aim(read, 9, 200);
  begin(rig, read);
  const Time begun = rig.plant.now();
  REQUIRE(rig.until([&] { return ended(read); }));
  CHECK(read.error == KernelError::kTimeout);
  CHECK(rig.plant.now() - begun >= 200 * kMs);
  CHECK(rig.plant.now() - begun <= 210 * kMs);
  CHECK(read.errorinfo == 0);
  CHECK(rig.plant.frames("609#") == std::vector<std::string>{"609#4004200000000000", "609#8004200000000008"});
}

TEST_CASE("TIMEOUT that the module sees first: 03h, and the abort code in ERRORINFO") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  aim(read, 9, 200);
  begin(rig, read);
  rig.until([&] { return !rig.plant.frames("609#").empty(); });
  rig.plant.pass(200 * kMs);  // the program's own time stands still
  const Time late = 200 * kMs;
  while (!ended(read)) {
    rig.program.cycle(rig.plant.now() - late);
    rig.plant.pass(1);
  }
  CHECK(read.error == KernelError::kTimeout);
  CHECK(read.errorinfo == 0x05040000);
}

TEST_CASE("TIMEOUT 0 waits for ever") {
  Rig rig;
  SdoRead4 read(rig.program.link);
  aim(read, 9);
  begin(rig, read);
  rig.cycles(20);
  for (int hour = 0; hour < 24; ++hour)
    rig.cycle(3600 * kSecond);
  rig.cycles(20);
  CHECK_FALSE(ended(read));
  read.enable = false;
  rig.cycles(5);
  CHECK(rig.plant.frames("609#").size() == 2);
}

TEST_CASE("TIMEOUT in the queue: 03h, and nothing is sent") {
  Rig rig;
  SdoRead4 first(rig.program.link), second(rig.program.link);
  aim(first, 9);
  aim(second, 5, 100);
  first.enable = second.enable = true;
  rig.program.blocks = {&first, &second};
  REQUIRE(rig.until([&] { return ended(second); }));
  CHECK(second.error == KernelError::kTimeout);
  CHECK(rig.plant.frames("605#").empty());
  CHECK_FALSE(ended(first));
}

TEST_CASE("TIMEOUT with a bus that is not well: ERROR is the kernel's state") {
  Rig rig;
  const auto [fault, error] =
      GENERATE(table<std::string, KernelError>({{"fault bus bus-off", KernelError::kBusOff},
                                                {"fault bus overflow", KernelError::kOverflow},
                                                {"fault bus error-passive", KernelError::kErrorPassive}}));
  rig.plant.command(fault);
  SECTION("SDO blocks") {
    SdoRead4 read(rig.program.link);
    aim(read, 9, 100);
    CHECK(rig.run(read).error == error);
    CHECK_FALSE(read.confirm);
    SdoWrite4 write(rig.program.link);
    write.device = 9;
    write.datalength = 1;
    write.timeout = 100;
    CHECK(rig.run(write).error == error);
    Bytes buffer(8);
    SdoRead read_any(rig.program.link);
    read_any.device = 9;
    read_any.data = buffer;
    read_any.timeout = 100;
    CHECK(rig.run(read_any).error == error);
    SdoWrite write_any(rig.program.link);
    write_any.device = 9;
    write_any.data = buffer;
    write_any.timeout = 100;
    CHECK(rig.run(write_any).error == error);
  }
  SECTION("the module's own nodes and objects do not need the bus") {
    GetLocalNodeId id(rig.program.link);
    id.timeout = 100;
    CHECK(rig.run(id).device == 127);
  }
}

TEST_CASE("Nmt on a bus that is off: ERROR is 10h after TIMEOUT") {
  Rig rig;
  rig.plant.command("fault bus bus-off");
  Nmt nmt(rig.program.link);
  nmt.device = 5;
  nmt.state = TransitionState::kStartRemoteNode;
  nmt.timeout = 100;
  CHECK(rig.run(nmt).error == KernelError::kBusOff);
}

TEST_CASE("a bus that is off and comes back within TIMEOUT: the execution is done") {
  Rig rig;
  rig.plant.command("fault bus bus-off until_ms=50");
  SdoRead4 read(rig.program.link);
  aim(read, 5, 1000);
  CHECK(rig.run(read).confirm);
}

namespace {

/// A bus that takes a millisecond for a frame, so that there is a middle.
const std::vector<std::string> kSlowBus{"--bit-rate", "125000"};
constexpr Time kStep = 100;

struct Transfer {
  std::unique_ptr<SdoAccess> block;
  Bytes bytes = Bytes(60, 0xA5);
};

std::unique_ptr<Transfer> transfer(Rig& rig, bool writes, SdoMode mode) {
  auto made = std::make_unique<Transfer>();
  if (writes) {
    auto block = std::make_unique<SdoWrite>(rig.program.link);
    block->mode = mode;
    block->data = made->bytes;
    made->block = std::move(block);
  } else {
    auto block = std::make_unique<SdoRead>(rig.program.link);
    block->data = made->bytes;
    made->block = std::move(block);
  }
  made->block->device = 5;
  made->block->index = 0x207F;
  made->block->timeout = 1000;
  return made;
}

/// Puts 60 bytes into node 5's 207Fh; with blocks, so that mode 0 reads them by block from then on.
void prepare(Rig& rig, SdoMode mode) {
  const auto first = transfer(rig, true, mode);
  rig.run(*first->block);
  REQUIRE(first->block->confirm);
  first->block->enable = false;
  rig.cycles(3);
}

/// Cancels after `count` frames of the transfer; returns whether there were so many before it was done.
bool cancelled_after(std::size_t count, bool writes, SdoMode mode) {
  Rig rig(kSlowBus);
  prepare(rig, mode);
  const std::size_t before = rig.plant.frames("605#").size() + rig.plant.frames("585#").size();
  const auto frames = [&] {
    return rig.plant.frames("605#").size() + rig.plant.frames("585#").size() - before;
  };
  const auto broken = transfer(rig, writes, mode);
  begin(rig, *broken->block);
  for (int i = 0; i < 10; ++i)
    rig.cycle(0);  // the first frame is on its way
  rig.until([&] { return ended(*broken->block) || frames() >= count; }, kStep);
  const bool in_the_middle = !ended(*broken->block);
  const std::size_t requests = rig.plant.frames("605#").size();
  broken->block->enable = false;
  rig.cycles(200);

  std::vector<std::string> after = rig.plant.frames("605#");
  after.erase(after.begin(), after.begin() + static_cast<std::ptrdiff_t>(requests));
  const std::string abort = "605#807F200000000008";
  const auto aborts = std::count(after.begin(), after.end(), abort);
  INFO("after " << count << " frames");
  CHECK(aborts <= 1);
  if (aborts == 1) CHECK(after.back() == abort);
  CHECK(after.size() <= 10);  // with blocks nine segments may be in the CAN controller already

  SdoRead4 next(rig.program.link);
  aim(next, 5, 5000);
  next.index = 0x1018;
  next.subindex = 1;
  rig.run(next);
  CHECK(next.confirm);
  CHECK(next.datalength == 4);
  const auto whole = transfer(rig, true, SdoMode::kSegmented);
  rig.run(*whole->block);
  CHECK(whole->block->confirm);
  return in_the_middle && aborts == 1;
}

}  // namespace

TEST_CASE(
    "cancelled after each frame of a transfer: one abort, nothing after it, and the next is undisturbed") {
  const bool writes = GENERATE(true, false);
  const SdoMode mode = GENERATE(SdoMode::kSegmented, SdoMode::kBlock);
  std::size_t count = 0;
  while (cancelled_after(count, writes, mode))
    ++count;
  // 60 bytes are nine segments: two frames each and two more, or with blocks nine and some around them.
  CHECK(count >= (mode == SdoMode::kSegmented ? 18u : 11u));
}

}  // namespace cbcan::cia405::test

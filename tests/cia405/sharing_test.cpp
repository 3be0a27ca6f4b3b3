// SPDX-License-Identifier: MIT
// Programs on connections of their own that share a window: against the real program.

#include <modbus.h>

#include "cia405/plant.hpp"
#include "support/catch.hpp"

namespace cbcan::cia405::test {

namespace {

/// R3770..R3777, read by somebody else.
std::vector<std::uint16_t> claims(int port) {
  modbus_t* const modbus = modbus_new_tcp("127.0.0.1", port);
  modbus_connect(modbus);
  std::vector<std::uint16_t> words(8, 0xFFFF);
  modbus_read_registers(modbus, 3770, 8, words.data());
  modbus_close(modbus);
  modbus_free(modbus);
  return words;
}

/// So many cycles of both programs, a millisecond each.
void run_both(Plant& plant, Program& first, Program& second, int count) {
  for (int i = 0; i < count; ++i) {
    first.cycle(plant.now());
    second.cycle(plant.now());
    plant.pass(kMs);
  }
}

/// Writes numbers to an object of node 5 + the program's number and reads them back, over and over.
struct Pair {
  Pair(Program& program, int number, std::uint8_t size) : write_(program.link), read_(program.link) {
    write_.device = read_.device = static_cast<std::uint8_t>(5 + number);
    write_.index = read_.index = static_cast<std::uint16_t>(0x2000 + size);
    write_.datalength = size;
    write_.data = {0, 0, static_cast<std::uint8_t>(size == 4 ? 0x5A : 0),
                   static_cast<std::uint8_t>(size == 4 ? number : 0)};
    program.blocks.push_back(&write_);
    program.blocks.push_back(&read_);
  }

  void turn(bool stops) {
    if (ended(write_)) end_write();
    if (ended(read_)) end_read();
    if (!stops && !busy()) begin_write();
  }
  bool busy() const { return write_.enable || read_.enable || ended(write_) || ended(read_); }

  int good = 0;  ///< numbers that came back
  int bad = 0;   ///< errors, and other numbers

 private:
  static bool ended(const FunctionBlock& block) { return block.confirm || block.error != KernelError::kNone; }
  void begin_write() {
    if (++write_.data[0] == 0) ++write_.data[1];
    write_.enable = true;
  }
  void end_write() {
    if (!write_.confirm) ++bad;
    write_.enable = false;
    read_.enable = true;
  }
  void end_read() {
    const bool same = read_.confirm && read_.datalength == write_.datalength && read_.data == write_.data;
    ++(same ? good : bad);
    read_.enable = false;
  }

  SdoWrite4 write_;
  SdoRead4 read_;
};

/// A program with two of them.
struct Worker {
  Worker(int port, int number)
      : program(port, Sharing{.program = number}), first_(program, number, 4), second_(program, number, 2) {}

  void cycle(Time now) {
    first_.turn(stops);
    second_.turn(stops);
    program.cycle(now);
  }
  bool busy() const { return first_.busy() || second_.busy(); }
  int good() const { return first_.good + second_.good; }
  int bad() const { return first_.bad + second_.bad; }

  Program program;
  bool stops = false;  ///< begins nothing more

 private:
  Pair first_, second_;
};

/// A node for each of the programs 0 to 3.
std::vector<std::string> four_nodes() {
  std::vector<std::string> options;
  for (const char* node : {"6", "7", "8"}) {
    options.push_back("--node");
    options.push_back(std::string(node) + "=" CBCAN_PLANTS "/demo/generic.eds");
  }
  return options;
}

/// Cycles of some programs in an order that a generator makes, a part of a millisecond each. The module's
/// time stands still.
struct Interleaved {
  explicit Interleaved(std::vector<Worker*> workers, Time now = 0)
      : workers_(std::move(workers)), now_(now) {}

  void cycles(int count) {
    for (int i = 0; i < count; ++i) {
      workers_[random(workers_.size())]->cycle(now_);
      now_ += 100;
    }
  }
  /// No more new ones; the ones that have begun end.
  void wind_up() {
    for (Worker* worker : workers_)
      worker->stops = true;
    while (std::ranges::any_of(workers_, &Worker::busy))
      cycles(1);
    cycles(100);
  }

 private:
  /// The same on every machine.
  std::size_t random(std::size_t sides) {
    state_ = state_ * 1664525 + 1013904223;
    return (state_ >> 8) % sides;
  }

  std::vector<Worker*> workers_;
  Time now_;
  std::uint32_t state_ = 1;
};

}  // namespace

TEST_CASE("two programs, hundreds of transactions: none is lost, none is mixed up, and they take turns") {
  Plant plant(four_nodes());
  Worker first(plant.port(), 0), second(plant.port(), 1);
  Interleaved both({&first, &second});
  both.cycles(20'000);
  both.wind_up();
  CHECK(first.bad() == 0);
  CHECK(second.bad() == 0);
  CHECK(first.good() > 200);
  CHECK(std::abs(first.good() - second.good()) <= first.good() / 20);
  // Each write and each read is on the bus once.
  for (const char* begin : {"605#2", "605#4"})
    CHECK(plant.frames(begin).size() == static_cast<std::size_t>(first.good()));
  for (const char* begin : {"606#2", "606#4"})
    CHECK(plant.frames(begin).size() == static_cast<std::size_t>(second.good()));
  CHECK(claims(plant.port()) == std::vector<std::uint16_t>(8));
}

TEST_CASE("four programs, one of them slow: each gets its turn") {
  Plant plant(four_nodes());
  std::vector<std::unique_ptr<Worker>> workers;
  for (int i = 0; i < 4; ++i)
    workers.push_back(std::make_unique<Worker>(plant.port(), i));
  for (Time ms = 0; ms < 4000; ++ms) {
    for (std::size_t i = 0; i < 3; ++i)
      workers[i]->cycle(ms * kMs);
    if (ms % 20 == 0) workers[3]->cycle(ms * kMs);
  }
  for (const auto& worker : workers)
    CHECK(worker->bad() == 0);
  // An execution of the slow one takes some ten of its cycles, two hundred milliseconds: the window, two
  // settings, the service, and each is a request and a poll.
  CHECK(workers[3]->good() >= 4);
  const auto [least, most] = std::minmax({workers[0]->good(), workers[1]->good(), workers[2]->good()});
  CHECK(least >= 10);
  CHECK(most - least <= 1);
}

TEST_CASE("a program alone keeps the window while it has work, and the module's settings with it") {
  Plant plant;
  Program alone(plant.port(), Sharing{.program = 3});
  std::vector<std::unique_ptr<SdoRead4>> reads;
  for (int i = 0; i < 4; ++i) {
    reads.push_back(std::make_unique<SdoRead4>(alone.link));
    reads.back()->device = 5;
    reads.back()->index = 0x2004;
    reads.back()->timeout = 300;
    reads.back()->enable = true;
    alone.blocks.push_back(reads.back().get());
  }
  int cycles = 0;
  while (!reads.back()->confirm) {
    alone.cycle(plant.now());
    ++cycles;
  }
  // One to connect; two to own the window; two transactions for settings and four reads, two requests each;
  // and the last response.
  CHECK(cycles <= 1 + 1 + 2 + 12 + 1);
}

TEST_CASE("a program that dies as the owner: its transaction is cancelled, the next goes on in a second") {
  Plant plant(four_nodes());
  Worker second(plant.port(), 1);
  {
    Program first(plant.port(), Sharing{.program = 0});
    SdoRead4 read(first.link);
    read.device = 99;  // there is no such node
    read.enable = true;
    first.blocks = {&read};
    while (plant.frames("663#").empty()) {
      first.cycle(plant.now());
      plant.pass(kMs);
    }
    first.blocks.clear();
  }  // its connection is closed, and nothing is said
  CHECK(claims(plant.port())[0] != 0);
  const Time died = plant.now();
  while (second.good() == 0 && plant.now() < died + 2 * kSecond) {
    second.cycle(plant.now());
    plant.pass(kMs);
  }
  CHECK(second.good() > 0);
  CHECK(second.bad() == 0);
  CHECK(plant.now() - died >= kSecond);
  CHECK(plant.now() - died <= kSecond + 50 * kMs);
  CHECK(plant.frames("663#") == std::vector<std::string>{"663#4000000000000000", "663#8000000000000008"});
  CHECK(claims(plant.port())[0] == 0);
}

TEST_CASE("a program that dies while it waits does not hold up others for more than a quarter of a second") {
  Plant plant(four_nodes());
  Worker first(plant.port(), 0), third(plant.port(), 2);
  // Program 1 waits and dies.
  {
    Program second(plant.port(), Sharing{.program = 1});
    SdoRead4 read(second.link);
    read.device = 5;
    read.enable = true;
    second.blocks = {&read};
    while (claims(plant.port())[1] == 0)
      second.cycle(plant.now());
    second.blocks.clear();
  }
  Interleaved rest({&first, &third});
  rest.cycles(15'000);  // one and a half seconds
  rest.wind_up();
  CHECK(claims(plant.port())[1] == 0);
  CHECK(first.good() > 50);
  CHECK(third.good() > 50);
  CHECK(first.bad() + third.bad() == 0);
}

TEST_CASE("an owner that stood still too long is none any more: 21h, and the new owner is not disturbed") {
  Plant plant(four_nodes());
  Program first(plant.port(), Sharing{.program = 0});
  Worker second(plant.port(), 1);
  SdoRead4 read(first.link);
  read.device = 99;
  read.enable = true;
  first.blocks = {&read};
  while (plant.frames("663#").empty()) {
    first.cycle(plant.now());
    plant.pass(kMs);
  }
  while (second.good() < 4) {
    second.cycle(plant.now());
    plant.pass(kMs);
  }
  first.cycle(plant.now());
  first.cycle(plant.now());
  CHECK(read.error == KernelError::kInternal);
  read.enable = false;
  first.cycle(plant.now());
  read.device = 5;
  read.enable = true;
  while (!read.confirm && read.error == KernelError::kNone) {
    first.cycle(plant.now());
    second.cycle(plant.now());
    plant.pass(kMs);
  }
  CHECK(read.error == KernelError::kOther);  // 0000h is no object of node 5: it has been asked
  CHECK(second.bad() == 0);
}

TEST_CASE("a waiting block that is cancelled takes its program's claim back") {
  Plant plant;
  Program first(plant.port(), Sharing{.program = 0}), second(plant.port(), Sharing{.program = 1});
  SdoRead4 hangs(first.link), waits(second.link);
  hangs.device = waits.device = 99;
  first.blocks = {&hangs};
  second.blocks = {&waits};
  const auto cycles = [&](int count) { run_both(plant, first, second, count); };
  hangs.enable = true;
  cycles(20);
  waits.enable = true;
  cycles(20);
  CHECK(claims(plant.port())[0] % 2 == 0);
  CHECK(claims(plant.port())[1] % 2 == 1);
  waits.enable = false;
  cycles(5);
  CHECK(claims(plant.port())[0] != 0);
  CHECK(claims(plant.port())[1] == 0);
  hangs.enable = false;
  cycles(5);
  CHECK(claims(plant.port())[0] == 0);
  CHECK(plant.frames("663#") == std::vector<std::string>{"663#4000000000000000", "663#8000000000000008"});
}

TEST_CASE("TIMEOUT in a shared window: cancelled, 03h, and the one that waits goes on") {
  Plant plant;
  Program first(plant.port(), Sharing{.program = 0}), second(plant.port(), Sharing{.program = 1});
  SdoRead4 hangs(first.link);
  hangs.device = 99;
  hangs.timeout = 100;
  GetLocalNodeId waits(second.link);
  first.blocks = {&hangs};
  second.blocks = {&waits};
  hangs.enable = true;
  run_both(plant, first, second, 20);
  waits.enable = true;
  run_both(plant, first, second, 100);
  CHECK(hangs.error == KernelError::kTimeout);
  CHECK(waits.confirm);
  CHECK(plant.frames("663#") == std::vector<std::string>{"663#4000000000000000", "663#8000000000000008"});
}

TEST_CASE("the window is kept to the end of an execution, whatever other blocks of the program do") {
  Plant plant;
  Program first(plant.port(), Sharing{.program = 0}), second(plant.port(), Sharing{.program = 1});
  GetLocalNodeId done(first.link), waits(second.link);
  SdoRead4 hangs(first.link), late(first.link);
  hangs.device = 99;
  late.timeout = 100;
  first.blocks = {&done, &hangs, &late};
  second.blocks = {&waits};
  const auto cycles = [&](int count) { run_both(plant, first, second, count); };
  done.enable = true;
  cycles(20);
  REQUIRE(done.confirm);
  hangs.enable = true;
  cycles(20);
  waits.enable = late.enable = true;
  cycles(20);
  done.enable = false;
  cycles(20);
  CHECK(claims(plant.port())[0] != 0);
  CHECK(claims(plant.port())[0] % 2 == 0);
  CHECK_FALSE(waits.confirm);
  cycles(100);
  CHECK(late.error == KernelError::kTimeout);
  CHECK(claims(plant.port())[0] % 2 == 0);
  CHECK_FALSE(waits.confirm);
  CHECK(plant.frames("663#").size() == 1);
}

}  // namespace cbcan::cia405::test

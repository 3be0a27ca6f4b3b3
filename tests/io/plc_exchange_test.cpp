// SPDX-License-Identifier: MIT
// A PLC that owns its registers, and the module's requests to it, with random failures between them: no old result
// is accepted, nothing is executed twice, no result is inconsistent.

#include "plc_rig.hpp"

using namespace cbcan;
using namespace cbcan::io;
using namespace cbcan::io::test;

namespace {

using Log = std::vector<std::string>;

/// A PLC's registers from `first` on, and its Modbus server.
struct Registers {
  std::uint16_t first = 1024;
  std::vector<std::uint16_t> words = std::vector<std::uint16_t>(kPlcWords);

  /// "R1024+70", "W1024+1"
  std::string serve(const window::Request& request, std::vector<std::uint16_t>& response) {
    if (request.words.empty()) {
      const auto from = words.begin() + (request.read_address - first);
      response.assign(from, from + request.count);
      return "R" + std::to_string(request.read_address) + "+" + std::to_string(request.count);
    }
    std::ranges::copy(request.words, words.begin() + (request.write_address - first));
    return "W" + std::to_string(request.write_address) + "+" + std::to_string(request.words.size());
  }
};

/// One round, with `between` called between two requests.
template <class Between>
Log round(PlcExchange& exchange, Registers& registers, Between between) {
  Log log;
  exchange.begin();
  while (const auto request = exchange.next()) {
    std::vector<std::uint16_t> words;
    log.push_back(registers.serve(*request, words));
    between(log.size());
    exchange.responded(words);
  }
  return log;
}

Log round(PlcExchange& exchange, Registers& registers) {
  return round(exchange, registers, [](std::size_t) {});
}

/// A module, a PLC and their exchange.
struct Bench {
  ScannedModule module{50};
  ModuleUnit unit{module};
  Registers registers;

  void put(std::size_t at, std::initializer_list<std::uint16_t> words) {
    std::ranges::copy(words, registers.words.begin() + static_cast<std::ptrdiff_t>(at));
  }
  std::vector<std::uint16_t> words(std::size_t at, std::size_t count) {
    const auto from = registers.words.begin() + static_cast<std::ptrdiff_t>(at);
    return {from, from + static_cast<std::ptrdiff_t>(count)};
  }
};

using Words = std::vector<std::uint16_t>;

constexpr std::uint16_t kReadValueLow = 0x6075;  // 300005h * 9E3779B1h, low word
constexpr std::uint16_t kReadValueHigh = 0xE845;

struct Interleaving {
  Interleaving(std::uint32_t seed, bool scanner)
      : random_(seed),
        exchange_(make_exchange(scanner, unit_, 1024)),
        program(make_program(scanner, registers_.words, module.node, polls_, 60)) {}

  void step() {
    const unsigned dice = pick(1000);
    if (dice < 250) {
      program->scan();
    } else if (dice < 600) {
      request();
    } else if (dice < 780) {
      module.deliver_response();
    } else if (dice < 930) {
      module.pass(pick(3000));
    } else if (dice < 940) {
      module.lose_response();
    } else if (dice < 960) {
      module.pass(60'000);
    } else if (dice < 970) {
      lose();
    } else if (dice < 975) {
      lose();
      program->restart(pick(2) == 0);
    } else if (dice < 980) {
      program->restart(true);  // the connection stays open
    } else if (dice < 990) {
      if (sent_) exchange_->lost();  // an exception
      sent_.reset();
    }
  }

  ScannedModule module{50};

 private:
  unsigned pick(unsigned below) { return static_cast<unsigned>(random_() % below); }

  /// Sends the next request, or delivers the response to the last one.
  void request() {
    if (sent_) {
      sent_.reset();
      return exchange_->responded(response_);
    }
    sent_ = exchange_->next();
    if (!sent_) {
      ++polls_;
      exchange_->begin();
      sent_ = exchange_->next();
    }
    response_.clear();
    if (sent_) registers_.serve(*sent_, response_);
  }

  /// Loses the request or its response.
  void lose() {
    const auto request = sent_ ? std::nullopt : exchange_->next();
    if (request && pick(2) == 0) registers_.serve(*request, response_);
    sent_.reset();
    exchange_->lost();
  }

  std::mt19937 random_;
  ModuleUnit unit_{module};
  Registers registers_;
  std::unique_ptr<PlcExchange> exchange_;
  std::optional<window::Request> sent_;
  std::vector<std::uint16_t> response_;
  unsigned polls_ = 0;

 public:
  std::unique_ptr<PlcProgram> program;
};

void check_interleavings(bool scanner, std::uint32_t seeds) {
  unsigned ended = 0;
  for (std::uint32_t seed = 1; seed <= seeds; ++seed) {
    INFO("seed " << seed);
    Interleaving interleaving(seed, scanner);
    for (int i = 0; i < 2000; ++i)
      interleaving.step();
    interleaving.program->check();
    ended += interleaving.program->ended();
  }
  CHECK(ended > 20 * seeds);
}

}  // namespace

TEST_CASE("a request in the PLC: read whole, read again, its result written, R3700 last") {
  Bench bench;
  WindowExchange exchange(bench.unit, 1024);
  CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
  bench.put(0, {0xCA0E, 5055, 5, 0x3000, 5, 20, 0xAAAA, 0xBBBB, 0xCCCC});
  CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
  CHECK(round(exchange, bench.registers) == Log{"R1024+6"});
  bench.module.deliver_response();
  const auto look = exchange.next();  // immediately
  REQUIRE(look);
  CHECK(round(exchange, bench.registers) == Log{"R1024+6", "W1029+3", "W1024+1"});
  CHECK(bench.words(0, 9) == Words{0, 5055, 5, 0x3000, 5, 4, kReadValueLow, kReadValueHigh, 0xCCCC});
  CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
  CHECK(bench.module.node.transfers == 1);
}

TEST_CASE(
    "a request that the module finds at its start is executed, or answered by 5 where the PLC wants that") {
  Bench bench;
  const bool refuses = GENERATE(false, true);
  WindowExchange exchange(bench.unit, 1024, refuses);
  bench.put(0, {0xCA0E, 5066, 5, 0x2000, 0, 4, 1, 2});
  CHECK(round(exchange, bench.registers) ==
        (refuses ? Log{"R1024+70", "R1024+6", "W1024+1"} : Log{"R1024+70"}));
  CHECK(bench.words(0, 8) ==
        Words{refuses ? std::uint16_t{5} : std::uint16_t{0xCA0E}, 5066, 5, 0x2000, 0, 4, 1, 2});
  if (!refuses) {
    bench.module.deliver_response();
    round(exchange, bench.registers);
  }
  CHECK(bench.module.node.transfers == (refuses ? 0 : 1));
  bench.put(0, {0xCA0E});  // the next one is executed
  round(exchange, bench.registers);
  bench.module.deliver_response();
  round(exchange, bench.registers);
  CHECK(bench.words(0, 1) == Words{0});
  CHECK(bench.module.node.transfers == (refuses ? 1 : 2));
}

TEST_CASE("a request after the first read is executed in any case") {
  Bench bench;
  WindowExchange exchange(bench.unit, 1024, true);
  round(exchange, bench.registers);
  bench.put(0, {0xCA0E, 5066, 5, 0x2000, 0, 4, 1, 2});
  CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
}

TEST_CASE("only the words that the contract changes are written") {
  Bench bench;
  WindowExchange exchange(bench.unit, 1024);
  const auto execute = [&] {
    round(exchange, bench.registers);
    bench.module.deliver_response();
    return round(exchange, bench.registers);
  };
  bench.put(0, {0xCA0E, 5066, 5, 0x2000, 0, 4, 1, 2});
  CHECK(execute() == Log{"R1024+6", "W1024+1"});
  bench.put(0, {0xCA0E, 1, 5, 0x2000, 0, 4, 1, 2});  // no such command
  CHECK(round(exchange, bench.registers) == Log{"R1024+70", "R1024+6", "W1024+1"});
  CHECK(bench.words(0, 1) == Words{1});
  bench.put(0, {0xCA0E, 5055, 5, 0x2000, 0, 0, 7, 8, 9});  // no size
  CHECK(round(exchange, bench.registers) == Log{"R1024+70", "R1024+6", "W1030+2", "W1024+1"});
  CHECK(bench.words(0, 9) == Words{4, 5055, 5, 0x2000, 0, 0, 0x0047, 0x0604, 9});
}

TEST_CASE("a request that is gone, or another one, is cancelled, and nothing is written") {
  Bench bench;
  WindowExchange exchange(bench.unit, 1024);
  bench.put(0, {0xCA0E, 5055, 5, 0x3000, 5, 4});
  round(exchange, bench.registers);
  bench.put(0, {0});
  CHECK(round(exchange, bench.registers) == Log{"R1024+6"});
  CHECK(bench.module.coprocessor.counters().cancelled == 1);
  bench.put(0, {0xCA0E, 5055, 5, 0x3000, 6, 4});
  bench.module.pass(60'000);  // quarantine
  round(exchange, bench.registers);
  bench.put(4, {7});
  CHECK(round(exchange, bench.registers) == Log{"R1024+6", "R1024+70"});
  CHECK(bench.module.coprocessor.counters().cancelled == 2);

  SECTION("between the result and the look") {
    bench.module.pass(120'000);
    const Log log = round(exchange, bench.registers, [&](std::size_t requests) {
      if (requests == 1) bench.put(0, {0});
    });
    CHECK(log.front() == "R1024+6");
  }
}

TEST_CASE("a request of another client at R3700 of the module is awaited") {
  Bench bench;
  WindowExchange exchange(bench.unit, 1024);
  bench.module.write(3700, Words{0xCA0E, 5055, 5, 0x3000, 9, 4});
  bench.put(0, {0xCA0E, 5055, 5, 0x3000, 5, 4});
  CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
  bench.module.deliver_response();
  CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
  bench.module.deliver_response();
  CHECK(round(exchange, bench.registers) == Log{"R1024+6", "W1029+3", "W1024+1"});
  CHECK(bench.words(6, 2) == Words{kReadValueLow, kReadValueHigh});
}

TEST_CASE("a result that could not be written is written later, and the request not executed again") {
  Bench bench;
  WindowExchange exchange(bench.unit, 1024);
  bench.put(0, {0xCA0E, 5055, 5, 0x3000, 5, 20});
  round(exchange, bench.registers);
  bench.module.deliver_response();
  exchange.begin();
  Words response;
  const auto pass = [&] {
    bench.registers.serve(*exchange.next(), response);
    exchange.responded(response);
  };
  SECTION("behind the look") {
    pass();
    exchange.lost();
    CHECK_FALSE(exchange.next());  // until the next round
    CHECK(round(exchange, bench.registers) == Log{"R1024+70", "W1029+3", "W1024+1"});
  }
  SECTION("lost, with half of it written") {
    pass();
    pass();
    exchange.lost();
    CHECK_FALSE(exchange.next());
    CHECK(round(exchange, bench.registers) == Log{"R1024+70", "W1029+3", "W1024+1"});
  }
  SECTION("lost, and the PLC has been started anew with another request") {
    exchange.lost();
    bench.put(0, {0xCA0E, 5066, 5, 0x2000, 0, 4, 1, 2});
    CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
    bench.module.deliver_response();
    CHECK(round(exchange, bench.registers) == Log{"R1024+6", "W1024+1"});
    CHECK(bench.module.node.written.size() == 1);
    return;
  }
  CHECK(bench.words(0, 8) == Words{0, 5055, 5, 0x3000, 5, 4, kReadValueLow, kReadValueHigh});
  CHECK(bench.module.node.transfers == 1);
}

TEST_CASE(
    "the scanner window's blocks in the PLC: OUT and the head of IN are read, IN is written where it "
    "differs") {
  Bench bench;
  ScannerExchange exchange(bench.unit, 1024, 500, 600);
  CHECK(round(exchange, bench.registers) == Log{"R1024+74", "W1095+3"});
  CHECK(bench.words(70, 4) == Words{0, 5, 0, 0});
  CHECK(round(exchange, bench.registers) == Log{"R1024+74"});
  bench.put(0, {1});
  CHECK(round(exchange, bench.registers) == Log{"R1024+74", "W1095+3", "W1094+1"});
  bench.put(0, {2, 5055, 5, 0x3000, 5, 4});
  CHECK(round(exchange, bench.registers) == Log{"R1024+74", "W1095+3"});
  CHECK(bench.words(70, 4) == Words{1, 5, 2, 0});
  bench.module.deliver_response();
  REQUIRE(exchange.next());  // immediately
  CHECK(round(exchange, bench.registers) == Log{"W1095+5", "W1094+1"});
  CHECK(bench.words(70, 6) == Words{2, 0, 2, 4, kReadValueLow, kReadValueHigh});
  bench.put(70, {0, 0, 0, 0, 0, 0});  // the PLC's program has been restarted
  CHECK(round(exchange, bench.registers) == Log{"R1024+74", "W1095+5", "W1094+1"});
  CHECK(bench.words(70, 6) == Words{2, 0, 2, 4, kReadValueLow, kReadValueHigh});
}

TEST_CASE("after a loss nothing is sent before the next round, also when the module has a result") {
  Bench bench;
  const auto exchange = make_exchange(GENERATE(false, true), bench.unit, 1024);
  exchange->begin();
  REQUIRE(exchange->next());
  exchange->lost();
  CHECK_FALSE(exchange->next());
  exchange->begin();
  CHECK(exchange->next());
}

TEST_CASE("after a loss a write of other data is another request, the same is not") {
  Bench bench;
  WindowExchange exchange(bench.unit, 1024);
  bench.put(0, {0xCA0E, 5066, 5, 0x2000, 0, 4, 1, 2});
  round(exchange, bench.registers);
  exchange.lost();
  CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
  CHECK(bench.module.coprocessor.counters().cancelled == 0);
  exchange.lost();
  bench.put(6, {3});
  CHECK(round(exchange, bench.registers) == Log{"R1024+70"});
  CHECK(bench.module.coprocessor.counters().cancelled == 1);
}

TEST_CASE("process data: outputs are read, inputs written as they change, and all of them now and then") {
  Bench bench;
  ProcessExchange exchange(bench.unit, 1024, 3800);
  bench.module.registers[3800] = 7;
  CHECK(round(exchange, bench.registers) == Log{"R1088+64", "W1024+64"});
  CHECK(round(exchange, bench.registers) == Log{"R1088+64"});
  bench.put(64 + 3, {0x1234});
  bench.module.registers[3810] = 8;
  bench.module.registers[3812] = 9;
  CHECK(round(exchange, bench.registers) == Log{"R1088+64", "W1034+3"});
  CHECK(bench.module.registers[3867] == 0x1234);
  CHECK(bench.words(10, 3) == Words{8, 0, 9});
  exchange.begin();
  exchange.lost();
  bench.put(10, {0});
  CHECK(round(exchange, bench.registers) == Log{"R1088+64", "W1024+64"});
  CHECK(bench.words(10, 1) == Words{8});
  bench.put(10, {0});
  for (int i = 0; i < 99; ++i)
    CHECK(round(exchange, bench.registers) == Log{"R1088+64"});
  CHECK(round(exchange, bench.registers) == Log{"R1088+64", "W1024+64"});
}

TEST_CASE("registers that are copied: in parts, as they change, and all of them in the round after a loss") {
  Bench bench;
  CopyExchange exchange(bench.unit, 1024, 3928, 138);
  const Log all{"W1024+123", "W1147+15"};
  exchange.begin();
  for (const bool changes : {false, true}) {
    REQUIRE(exchange.next());
    exchange.lost();
    CHECK_FALSE(exchange.next());  // until the next round
    if (changes) ++bench.module.registers[3930];
    CHECK_FALSE(exchange.next());
    CHECK(round(exchange, bench.registers) == all);
    CHECK(round(exchange, bench.registers).empty());
    ++bench.module.registers[3930];
    exchange.begin();
  }
  CHECK(round(exchange, bench.registers) == Log{"W1026+1"});
}

TEST_CASE("registers that the PLC owns: nothing is believed, executed twice or torn that should not be") {
  check_interleavings(GENERATE(false, true), 200);
}

TEST_CASE("registers that the PLC owns, for long", "[.long]") {
  check_interleavings(GENERATE(false, true), 20'000);
}

// SPDX-License-Identifier: MIT
// Not covered by the tests of the contract: cancelled at the last moment, and two windows in one poll.

#include "support/bench.hpp"

using cbcan::test::Bench;

TEST_CASE("Cancelled between the last response and the result: R3700 keeps what the PLC wrote") {
  Bench bench;
  bench.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
  bench.reg(3700) = 0;
  bench.coprocessor.on_frame(cbcan::test::frame_from("585#4300200101000000"), bench.now);
  CHECK(bench.reg(3700) == 0);
  bench.poll().expect_silence();
  CHECK(bench.coprocessor.counters().cancelled == 1);
}

TEST_CASE("Without a scanner window no request of it waits") {
  CHECK(!cbcan::ScannerWindow().waiting());
}

TEST_CASE("A request that still waits when another has ended at once is begun by a poll that is due now") {
  Bench bench;
  const auto ask = [&bench](std::initializer_list<std::uint16_t> request) {
    bench.registers.put(500, request);
    bench.coprocessor.on_registers_written(500, 70, bench.now);
  };
  ask({1, 5055, 5, 0x2000, 0, 4});  // the first number since the start
  ask({2, 5055, 5, 0x2000, 0, 4});
  bench.poll().expect("605#4000200000000000");
  bench.read(0, 0x3001, 0, 1);
  CHECK(bench.busy());
  ask({3, 5055, 6, 0x2000, 0, 4});
  bench.expect("605#8000200000000008");
  bench.coprocessor.poll(bench.now);
  bench.check_done();
  bench.expect_silence();
  CHECK(bench.coprocessor.deadline() <= bench.now);
  bench.pass(0).expect("606#4000200000000000");
}

TEST_CASE("A request waits while the own node is being reset, and then finds the values of power-on") {
  const bool by_scanner = GENERATE(true, false);
  Bench bench;
  const auto scan = [&bench](std::uint16_t number) {
    bench.registers.put(500, {number, 5055, 0, 0x3003, 0, 2});
    bench.coprocessor.on_registers_written(500, 70, bench.now);
  };
  scan(1);  // the first number since the start
  bench.write(0, 0x3003, 0, 2, {250}).check_done();
  bench.coprocessor.on_frame(cbcan::test::frame_from("000#817F"), bench.now);
  if (by_scanner) {
    scan(2);
  } else {
    bench.registers.put(3701, {5055, 0, 0x3003, 0, 2});
    bench.reg(3700) = 0xCA0E;
  }
  do {
    CHECK(bench.coprocessor.poll(bench.now) <= bench.now);
    CHECK((by_scanner ? bench.reg(600) != 2 : bench.busy()));
  } while (bench.coprocessor.own_node().resetting());
  bench.poll().expect("77F#00");
  CHECK((by_scanner ? bench.reg(600) == 2 : bench.reg(3700) == 0));
  CHECK((by_scanner ? bench.reg(604) : bench.reg(3706)) == 1000);
}

TEST_CASE("The last place for a scanner window") {
  cbcan::Coprocessor::Settings settings;
  settings.scanner_out_first = 65536 - 70;
  cbcan::test::CoprocessorRig bench(settings);
  bench.start();
  bench.registers.put(500, {7});
  bench.coprocessor.on_registers_written(settings.scanner_out_first, 1, bench.now);
  bench.pass(0);
  CHECK(bench.reg(602) == 7);
}

// SPDX-License-Identifier: MIT
// Node state service: how long a message is believed and a guarding response awaited, to the microsecond.

#include "support/bench.hpp"

using cbcan::kMillisecond;
using cbcan::kSecond;
using cbcan::test::Bench;

TEST_CASE("Node state: heartbeat and boot-up, while they are fresh") {
  struct Row {
    const char* frame;
    std::uint16_t state;
  };
  for (const Row& row :
       {Row{"705#04", 4}, Row{"705#05", 5}, Row{"705#7F", 127}, Row{"705#00", 127}, Row{"705#85", 5}}) {
    Bench bench;
    bench.arrive(row.frame);
    bench.pass(2 * kSecond);
    bench.read(5, 0x300C, 0, 0).check_done();
    CHECK(bench.reg(3705) == 1);
    CHECK(bench.reg(3706) == row.state);
    bench.pass(1);
    bench.read(5, 0x300C, 0, 0).expect("705#R1");
    bench.pass(100 * kMillisecond).check_done();
    CHECK(bench.reg(3706) == 6);
  }
}

TEST_CASE("Node state: guarding, a response within 100 ms or 6") {
  Bench bench;
  bench.read(77, 0x300C, 0, 0).expect("74D#R1");
  SECTION("toggle 0") {
    bench.arrive("74D#05");
  }
  SECTION("toggle 1") {
    bench.arrive("74D#85");
  }
  SECTION("at the last moment") {
    bench.pass(100 * kMillisecond - 1);
    bench.arrive("74E#04");
    bench.arrive("74D#33");  // no such state
    CHECK(bench.busy());
    bench.arrive("74D#05");
  }
  SECTION("too late") {
    bench.pass(100 * kMillisecond);
    CHECK(bench.reg(3706) == 6);
    bench.check_done();
    return;
  }
  bench.check_done();
  CHECK(bench.reg(3706) == 5);
}

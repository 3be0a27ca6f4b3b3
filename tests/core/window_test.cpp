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

TEST_CASE("A request that still waits when another has ended at once is begun by a poll that is due now") {
  Bench bench;
  const auto ask = [&bench](std::initializer_list<std::uint16_t> request) {
    std::copy(request.begin(), request.end(), bench.out.begin());
    bench.coprocessor.on_registers_written(500, 70, bench.now);
  };
  ask({1, 5055, 5, 0x2000, 0, 4});  // the first number since the start
  ask({2, 5055, 5, 0x2000, 0, 4});
  bench.poll().expect("605#4000200000000000");
  bench.read(0, 0x3001, 0, 1);
  CHECK(bench.busy());
  ask({3, 5055, 6, 0x2000, 0, 4});
  bench.expect("605#8000200000000008");
  bench.poll();
  bench.check_done();
  bench.expect_silence();
  CHECK(bench.deadline <= bench.now);
  bench.poll().expect("606#4000200000000000");
}

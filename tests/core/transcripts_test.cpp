// SPDX-License-Identifier: MIT
// Every example with bytes in the documents, as it stands on the wire.

#include "support/bench.hpp"

using cbcan::test::Bench;

TEST_CASE("CBCAN, table 4: Start Remote to all nodes") {
  Bench bench;
  bench.write(3701, {5066});
  bench.write(3703, {0x1F82, 128});
  bench.write(3706, {5});
  bench.execute();
  bench.expect("000#0100");
  bench.check_done();
}

// The messages of an I/O module with node ID 42h, as its manual prints them.

TEST_CASE("I/O module 42h: write 300 to analogue output 1") {
  Bench bench;
  bench.write(0x42, 0x6411, 1, 2, {300});
  bench.expect("642#2B1164012C010000");
  CHECK(bench.busy());
  bench.arrive("5C2#6011640100000000");
  bench.check_done();
}

TEST_CASE("I/O module 42h: read analogue output 1 back") {
  Bench bench;
  bench.read(0x42, 0x6411, 1, 2);
  bench.expect("642#4011640100000000");
  bench.arrive("5C2#4B1164012C010000");
  bench.check_done();
  CHECK(bench.reg(3705) == 2);
  CHECK(bench.reg(3706) == 300);
}

TEST_CASE("I/O module 42h: a heartbeat every second") {
  Bench bench;
  bench.write(0x42, 0x1017, 0, 2, {1000});
  bench.expect("642#2B171000E8030000");
  bench.arrive("5C2#6017100000000000");
  bench.check_done();
  bench.arrive("742#7F");
  bench.read(0x42, 0x300C, 0, 1);
  bench.check_done();
  CHECK(bench.reg(3706) == 127);
}

TEST_CASE("I/O module 42h: SYNC every 10 ms, and its start") {
  Bench bench;
  bench.write(0x42, 0x1006, 0, 4, {0x2710, 0});
  bench.expect("642#2306100010270000");
  bench.arrive("5C2#6006100000000000");
  bench.check_done();
  bench.write(0x42, 0x1005, 0, 4, {0x0080, 0x4000});
  bench.expect("642#2305100080000040");
  bench.arrive("5C2#6005100000000000");
  bench.check_done();
}

TEST_CASE("I/O module 42h: NMT to all nodes and the states that come back") {
  struct Row {
    std::uint16_t command;
    const char* sent;
    const char* heartbeat;
    std::uint16_t state;
  };
  const Row rows[] = {
      {1, "000#0100", "742#05", 5}, {128, "000#8000", "742#7F", 127}, {2, "000#0200", "742#04", 4}};
  Bench bench;
  for (const Row& row : rows) {
    bench.write(0, 0x1F82, 128, 0, {row.command});
    bench.expect(row.sent);
    bench.check_done();
    bench.arrive(row.heartbeat);
    bench.read(0x42, 0x300C, 0, 1);
    bench.check_done();
    CHECK(bench.reg(3706) == row.state);
  }
  bench.write(0, 0x1F82, 128, 0, {129});
  bench.expect("000#8100");
  bench.write(0, 0x1F82, 128, 0, {130});
  bench.expect("000#8200");
  bench.check_done();
}

TEST_CASE("Every size of an expedited answer: 4F, 4B, 47, 43") {
  struct Row {
    const char* answer;
    std::uint16_t size, low, high;
  };
  const Row rows[] = {{"5C2#4F11640111000000", 1, 0x11, 0xAAAA},
                      {"5C2#4B11640111220000", 2, 0x2211, 0xAAAA},
                      {"5C2#4711640111223300", 3, 0x2211, 0x0033},
                      {"5C2#4311640111223344", 4, 0x2211, 0x4433}};
  for (const Row& row : rows) {
    Bench bench;
    bench.write(3706, {0xAAAA, 0xAAAA});
    bench.read(0x42, 0x6411, 1, 128);
    bench.expect("642#4011640100000000");
    bench.arrive(row.answer);
    bench.check_done();
    CHECK(bench.reg(3705) == row.size);
    CHECK(bench.reg(3706) == row.low);
    CHECK(bench.reg(3707) == row.high);
  }
}

TEST_CASE("Every size of an expedited write: 2F, 2B, 27, 23") {
  const char* sent[] = {"642#2F11640111000000", "642#2B11640111220000", "642#2711640111223300",
                        "642#2311640111223344"};
  for (std::uint16_t size = 1; size <= 4; ++size) {
    Bench bench;
    bench.write(0x42, 0x6411, 1, size, {0x2211, 0x4433});
    bench.expect(sent[size - 1]);
    bench.arrive("5C2#6011640100000000");
    bench.check_done();
    CHECK(bench.reg(3705) == size);
    CHECK(bench.reg(3706) == 0x2211);
  }
}

// SPDX-License-Identifier: MIT
// The further SDO servers of a node: 1201h to 127Fh.

#include "node_rig.hpp"

namespace cbcan::test {

namespace {

/// Node 5 with 1201h on 645h and 5C5h, as in EDS files, and 1203h, which is not valid.
std::vector<ObjectRow> with_servers() {
  std::vector<ObjectRow> all = rows();
  const auto place = std::ranges::find(all, std::uint16_t{0x1400}, &ObjectRow::index);
  using enum DataType;
  all.insert(place, {{0x1201, 0, 0, kUnsigned8, 3, ObjectFlags::kRead},
                     {0x1201, 1, 1, kUnsigned32, 0x640, ObjectFlags::kReadWrite, true},
                     {0x1201, 2, 2, kUnsigned32, 0x5C0, ObjectFlags::kReadWrite, true},
                     {0x1203, 0, 0, kUnsigned8, 2, ObjectFlags::kRead},
                     {0x1203, 1, 2, kUnsigned32, 0x80000000}});
  return all;
}

}  // namespace

TEST_CASE("Node: a second SDO server where the file has it, next to the first one") {
  NodeBench bench({}, with_servers());
  bench.ask("645#4000200000000000", "5C5#4B00200007000000");
  bench.ask("645#2B00200011000000", "5C5#6000200000000000");
  bench.ask("605#4000200000000000", "585#4B00200011000000");
  bench.ask("645#4000300000000000", "5C5#8000300000000206");
  SECTION("both in the middle of a transfer") {
    bench.write("605#2100200002000000", "645#2100200002000000");
    bench.ask("605#0B22000000000000", "585#2000000000000000");
    bench.ask("645#0B33000000000000", "5C5#2000000000000000");
    CHECK(value_of(bench.node, 0x2000, 0) == 0x33);
  }
  SECTION("not in Stopped, and nothing goes on behind it") {
    bench.ask("645#2100200002000000", "5C5#6000200000000000");
    bench.send("000#0205");
    bench.send("645#0B33000000000000").expect_silence();
    bench.send("000#8005");
    bench.ask("645#0B33000000000000", "5C5#8000200001000405");
  }
}

TEST_CASE("Node: more SDO servers follow their objects, and are there when both CAN-IDs are") {
  NodeBench bench({}, with_servers());
  bench.ask("605#23031201B2060000", "585#6003120100000000");
  bench.send("6B2#4000200000000000").expect_silence();
  bench.ask("605#23031202B3060000", "585#6003120200000000");
  bench.ask("6B2#4000200000000000", "6B3#4B00200007000000");
  bench.ask("605#2301120100000080", "585#6001120100000000");
  bench.send("645#4000200000000000").expect_silence();
  bench.ask("000#8105", "705#00");
  bench.ask("645#4000200000000000", "5C5#4B00200007000000");
  bench.send("6B2#4000200000000000").expect_silence();
}

TEST_CASE(
    "Node: each SDO server ends a block download that its client has left, after the time of the setting") {
  SECTION("a second") {
    NodeBench bench({}, with_servers());
    bench.ask("605#C600200002000000", "585#A40020007F000000");
    bench.pass(500 * kMillisecond);
    bench.ask("645#C600200002000000", "5C5#A40020007F000000");
    bench.pass(500 * kMillisecond).expect_silence();
    bench.pass(1).expect("585#8000200000000405");
    bench.pass(500 * kMillisecond).expect("5C5#8000200000000405");
    bench.ask("605#4000200000000000", "585#4B00200007000000");
  }
  SECTION("another one, or none") {
    const auto timeout_ms = GENERATE(std::uint16_t{20}, std::uint16_t{0});
    sim::NodeParts parts;
    parts.block_timeout_ms = timeout_ms;
    NodeBench bench(parts, with_servers());
    bench.ask("605#C600200002000000", "585#A40020007F000000");
    bench.ask("645#C600200002000000", "5C5#A40020007F000000");
    bench.pass(20 * kMillisecond + 1);
    if (timeout_ms != 0) bench.expect("5C5#8000200000000405", "585#8000200000000405");
    bench.pass(100 * kSecond).expect_silence();
  }
}

}  // namespace cbcan::test

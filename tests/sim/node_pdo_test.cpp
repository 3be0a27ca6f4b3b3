// SPDX-License-Identifier: MIT
// Process data between nodes on one bus; PDOs alone: tests/core.

#include "node_rig.hpp"

namespace cbcan::test {

namespace {

/// Nodes 1 and 2; node 2 receives what node 1 transmits.
struct Pair {
  Pair() {
    bench.start().expect("701#00", "702#00");
    bench.write("602#2300140102020080", "602#2300140181010000");
  }
  void start() { bench.send("000#0100").expect("181#0000", "182#0000"); }
  std::uint64_t received() { return value_of(second, 0x6200, 1); }

  WorldBench bench;
  sim::Node& first = add_node(bench, 1);
  sim::Node& second = add_node(bench, 2);
};

}  // namespace

TEST_CASE("Node: the TPDO of one is the RPDO of another, with each event") {
  Pair pair;
  pair.start();
  pair.bench.input(pair.first, 0x6000, 1, 0x1234).expect("181#3412");
  CHECK(pair.received() == 0x1234);
  pair.bench.send("000#8002");  // Pre-operational: it receives no PDO
  pair.bench.input(pair.first, 0x6000, 1, 0x5678).expect("181#7856");
  CHECK(pair.received() == 0x1234);
}

TEST_CASE("Node: an RPDO's mapping changed at run time by the procedure of CiA 301") {
  NodeBench bench;
  sim::Node& node = bench.node;
  bench.ask("000#0105", "185#0000");
  bench.ask("605#2F00160000000000", "585#8000160022000008");  // not while it is valid
  bench.ask("605#2300140105020080", "585#6000140100000000");  // 1. invalid
  bench.ask("605#2300160108020062", "585#8000160122000008");  // not while sub 0 is not 0
  bench.ask("605#2F00160000000000", "585#6000160000000000");  // 2. no entries
  bench.ask("605#2300160108020062", "585#6000160100000000");  // 3. 6200h:2, 8 bits, then 6200h:1, 16 bits
  bench.ask("605#2300160210010062", "585#6000160200000000");
  bench.ask("605#2F00160002000000", "585#6000160000000000");  // 4. two entries
  bench.send("205#AABBCC");
  CHECK(value_of(node, 0x6200, 2) == 0);
  bench.ask("605#2300140105020000", "585#6000140100000000");  // 5. valid
  bench.send("205#AABBCC");
  CHECK(value_of(node, 0x6200, 2) == 0xAA);
  CHECK(value_of(node, 0x6200, 1) == 0xCCBB);
  bench.ask("205#AABB", "085#1082110100000000");      // too short: 8210h, RPDO 1
  bench.ask("205#112233", "085#0000000000000000");    // as it should be
  bench.ask("205#AABBCCDD", "085#2082110100000000");  // too long: 8220h, taken
  CHECK(value_of(node, 0x6200, 1) == 0xCCBB);
}

TEST_CASE("Node: it hears the new COB-ID, and the old one no more") {
  NodeBench bench;
  sim::Node& node = bench.node;
  bench.ask("000#0105", "185#0000");
  bench.send("205#0100");
  CHECK(value_of(node, 0x6200, 1) == 1);
  bench.write("605#2300140105020080", "605#2300140177030000");
  bench.send("205#0200");
  CHECK(value_of(node, 0x6200, 1) == 1);
  bench.send("377#0300");
  CHECK(value_of(node, 0x6200, 1) == 3);
  // That of a TPDO, which RTR requests. It is sent when it becomes valid.
  bench.ask("605#2300180185010080", "585#6000180100000000");
  bench.send("605#23001801F7010000").expect("1F7#0000", "585#6000180100000000");
  bench.send("185#R2").expect_silence();
  bench.ask("1F7#R2", "1F7#0000");
  // That of SYNC.
  bench.ask("605#2F00180201000000", "585#6000180200000000");
  bench.ask("080#", "1F7#0000");
  bench.ask("605#2305100090000000", "585#6005100000000000");
  bench.send("080#").expect_silence();
  bench.ask("090#", "1F7#0000");
  bench.ask("000#8205", "705#00");  // back to the factory values
  bench.ask("000#0105", "185#0000");
  bench.send("377#0400").expect_silence();
  bench.send("205#0500");
  CHECK(value_of(node, 0x6200, 1) == 5);
}

}  // namespace cbcan::test

// SPDX-License-Identifier: MIT
// Process data between nodes on one bus, configured by SDO as CiA 301 has it.

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
  pair.bench.send("000#8002");  // Pre-operational: it hears no PDO
  pair.bench.input(pair.first, 0x6000, 1, 0x5678).expect("181#7856");
  CHECK(pair.received() == 0x1234);
}

TEST_CASE("Node: synchronous TPDO to synchronous RPDO: sampled with one SYNC, in effect with the next") {
  Pair pair;
  WorldBench& bench = pair.bench;
  bench.write("601#2F00180201000000", "602#2F00140201000000");
  bench.send("000#0100").expect("182#0000");
  bench.input(pair.first, 0x6000, 1, 0x11).expect_silence();
  bench.ask("080#", "181#1100");
  CHECK(pair.received() == 0);
  bench.input(pair.first, 0x6000, 1, 0x22);
  bench.ask("080#", "181#2200");
  CHECK(pair.received() == 0x11);
}

TEST_CASE("Node: one node is the SYNC producer of all, and of itself") {
  Pair pair;
  WorldBench& bench = pair.bench;
  bench.write("601#2F00180201000000", "602#2F00180202000000");
  bench.send("000#0100").expect_silence();
  bench.write("602#23061000E8030000", "602#2305100080000040");
  bench.pass(kMillisecond).expect("080#", "181#0000");
  bench.pass(kMillisecond).expect("080#", "181#0000", "182#0000");
  bench.ask("602#2306100000000000", "582#6006100000000000");
  bench.pass(kSecond);
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

TEST_CASE("Node: reset communication brings the mapping back that the device was made with") {
  NodeBench bench;
  sim::Node& node = bench.node;
  bench.write("605#2300140105020080", "605#2F00160000000000", "605#2300160108020062", "605#2F00160001000000");
  bench.write("605#2300140105030000");
  bench.ask("000#8205", "705#00");
  bench.ask("000#0105", "185#0000");
  bench.send("305#99");
  CHECK(value_of(node, 0x6200, 2) == 0);
  bench.send("205#3412");
  CHECK(value_of(node, 0x6200, 1) == 0x1234);
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
  // A TPDO's, which RTR asks for. Made valid, it is sent.
  bench.ask("605#2300180185010080", "585#6000180100000000");
  bench.send("605#23001801F7010000").expect("1F7#0000", "585#6000180100000000");
  bench.send("185#R2").expect_silence();
  bench.ask("1F7#R2", "1F7#0000");
}

TEST_CASE("Node: SYNC on another identifier") {
  NodeBench bench;
  bench.ask("605#2F00180201000000", "585#6000180200000000");
  bench.send("000#0105");
  bench.ask("080#", "185#0000");
  bench.ask("605#2305100090000000", "585#6005100000000000");
  bench.send("080#").expect_silence();
  bench.ask("090#", "185#0000");
}

TEST_CASE("Node: remote and 29-bit frames are no requests, no commands and no process data") {
  NodeBench bench;
  sim::Node& node = bench.node;
  for (const char* frame : {"605#R8", "00000605#4000100000000000", "00000000#0105", "000#R2"})
    bench.send(frame);
  bench.expect_silence();
  CHECK(node.device().state() == nmt::State::kPreOperational);
  bench.ask("000#0105", "185#0000");
  for (const char* frame : {"205#R2", "00000205#0100", "00000080#"})
    bench.send(frame);
  CHECK(value_of(node, 0x6200, 1) == 0);
}

}  // namespace cbcan::test

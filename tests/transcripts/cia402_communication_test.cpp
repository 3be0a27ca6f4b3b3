// SPDX-License-Identifier: MIT
// The CiA 402 introduction, part on CiA 301: messages byte for byte, and its table of states and services.
//
//   Section of the introduction                  Case
//   NMT: 01h 02h 80h 81h 82h                     overview_test.cpp, "NMT: the five commands ..."
//   NMT examples: 81 00, 01 05                   overview_test.cpp, "NMT: the five commands ..."
//   Error control: node guarding                 tests/core/device_test.cpp, "Node guarding: the toggle bit
//   ..." Error control: heartbeat 0, 4, 5, 127        overview_test.cpp, "heartbeat: the four states"
//   Boot-up: 700h + node ID, one byte 0          overview_test.cpp, "heartbeat: the four states"
//   State-object relationship                    "which service is there in which state"
//   SDO: 600h, 580h + node ID                    all SDO cases
//   Expedited, segmented                         overview_test.cpp, "SDO: every n ...", "SDO: abort"
//   Protocol details: cs A0..A4, C0..C2          overview_test.cpp, "SDO: block ..."; without CRC:
//   tests/contract
//
// Its second part, CiA 402 itself: cia402_drive_test.cpp.

#include "demo_nodes.hpp"

namespace cbcan::test {

namespace {

using Frames = std::vector<std::string>;

/// An I/O module that produces every kind of message: SYNC every 10 ms, TIME every 50 ms, a heartbeat every
/// 20 ms.
struct Producer {
  Producer() {
    node.device().time_stamp().produce_every(50 * kMillisecond, bench.now);
    bench.start().expect("742#00");
    bench.expect_silence();
  }
  /// Identifiers received within 100 ms, while the input changes and an error occurs.
  std::set<std::string> identifiers() {
    bench.heard();
    bench.input(node, 0x6000, 1, 0xFF);
    bench.incident(node, "output-short-circuit", true);
    bench.send("642#4017100000000000");
    bench.pass(100 * kMillisecond);
    std::set<std::string> found;
    for (const std::string& frame : bench.heard())
      found.insert(frame.substr(0, 3));
    return found;
  }
  std::uint64_t outputs() { return node.device().dictionary().get(0x6200, 1); }

  WorldBench bench;
  sim::Node& node =
      add_demo_node(bench, "io_module.eds", 0x42,
                    {{0x1017, 0, 20}, {0x1005, 0, 0x40000080}, {0x1006, 0, 10'000}, {0x1012, 0, 0x40000100}});
};

}  // namespace

// The columns of the introduction's table are wrong: Pre-operational has five services and Stopped two. CiA
// 301, table 37, decides: no PDO in Pre-operational, only node and error control in Stopped.
TEST_CASE("CiA 402 introduction, state-object relationship: which service is there in which state") {
  struct Row {
    const char* state;
    const char* command;
    std::set<std::string> sent;
    std::uint64_t received;
  };
  for (const Row& row : std::initializer_list<Row>{
           {"Pre-operational", "000#8042", {"080", "0C2", "100", "5C2", "742"}, 0},
           {"Operational", "000#0142", {"080", "0C2", "100", "1C2", "2C2", "5C2", "742"}, 0x55},
           {"Stopped", "000#0242", {"742"}, 0}}) {
    INFO(row.state);
    Producer producer;
    producer.bench.send(row.command);
    producer.bench.send("242#55");
    CHECK(producer.outputs() == row.received);
    producer.bench.send("1C2#R1");
    CHECK(producer.bench.heard().empty() == (row.received == 0));
    producer.bench.send(row.command);
    std::set<std::string> sent = row.sent;
    sent.erase("2C2");  // once, when it became Operational
    CHECK(producer.identifiers() == sent);
    // Node control works in each state.
    producer.bench.send("000#8242");
    CHECK(producer.bench.heard() == Frames{"742#00"});
  }
}

}  // namespace cbcan::test
